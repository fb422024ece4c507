/* Runs the machine code of idlc/runtime/introspection.py: machine_code_structs FILE ENTRY...
 *
 * FILE is the code with room for its words. The type has a string, then two structures, of which
 * each has a number and a sequence of strings.
 */
#include <assert.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef struct { char *data; size_t size, capacity; } Text;
typedef struct { Text *data; size_t size, capacity; } Texts;
typedef struct { uint64_t number; Texts texts; } Inner;
typedef struct { Text text; Inner inner[2]; } Message;
typedef struct { Message *data; size_t size, capacity; } Messages;

static int blocks;
static void *last_seen[3];
static int answer;

static void *allocate(size_t count, size_t size, void *state) {
  assert(!state);
  void *block = count < 1000 ? calloc(count, size) : NULL;
  blocks += block != NULL;
  return block;
}

static void deallocate(void *block, void *state) {
  assert(!state);
  blocks -= block != NULL;
  free(block);
}

static int set_item(void *converter, void *memory, void *message) {
  last_seen[0] = converter, last_seen[1] = memory, last_seen[2] = message;
  return answer;
}

static void *get_item(void *converter, void *memory) {
  last_seen[0] = converter, last_seen[1] = memory;
  return last_seen[2];
}

static void set(Text *text) { *text = (Text) {allocate(3, 1, NULL), 2, 3}; }

static void fill(Message *message) {
  set(&message->text);
  for (int i = 0; i < 2; i++) {
    message->inner[i].texts = (Texts) {allocate(4, sizeof(Text), NULL), 3, 4};
    for (int k = 0; k < 4; k += 1 + i) set(message->inner[i].texts.data + k);
  }
}

int main(int count, char **words) {
  assert(count == 11);
  int converter;
  size_t text[] = {1, 0, 0, 0, 0};
  size_t inner[] = {1, 8, 0, sizeof(Text), (size_t) text};
  size_t plan[] = {2, 0, 1, sizeof(Text), (size_t) text, sizeof(Text), 2, sizeof(Inner), (size_t) inner};
  size_t sequence[] = {1, 0, 0, sizeof(Message), (size_t) plan};
  size_t values[] = {(size_t) allocate, (size_t) deallocate, (size_t) set_item, (size_t) get_item,
                     (size_t) &converter, (size_t) plan, (size_t) sequence, sizeof(Message)};
  int file = open(words[1], O_RDWR);
  off_t end = lseek(file, 0, SEEK_END);
  assert(write(file, values, sizeof values) == sizeof values);
  char *code = mmap(NULL, end + sizeof values, PROT_READ | PROT_EXEC, MAP_PRIVATE, file, 0);
  assert(code != MAP_FAILED);
  void *entry[9];
  for (int i = 0; i < 9; i++) entry[i] = code + atoi(words[2 + i]);
  Message *(*create)(void) = entry[0];
  void (*destroy)(Message *) = entry[1];
  bool (*convert_from_py)(void *, void *) = entry[2];
  void *(*convert_to_py)(void *) = entry[3];
  void (*finish)(Message *) = entry[4];
  bool (*resize)(Messages *, size_t) = entry[5];
  size_t (*length)(Messages *) = entry[6];
  Message *(*in_sequence)(Messages *, size_t) = entry[7], *(*in_array)(Message *, size_t) = entry[8];

  Message *message = create(), zero = {0};
  assert(blocks == 1 && !memcmp(message, &zero, sizeof zero));
  fill(message);
  message->inner[1].number = 7;
  finish(message);
  assert(blocks == 1 && message->inner[1].number == 7 && !message->inner[1].texts.data);
  fill(message);
  assert(convert_from_py(&count, message) && blocks == 1);
  assert(last_seen[0] == &converter && last_seen[1] == message && last_seen[2] == &count);
  answer = -1;
  assert(!convert_from_py(&count, message));
  last_seen[1] = NULL;
  assert(convert_to_py(message) == &count && last_seen[1] == message);
  fill(message);
  destroy(message);
  assert(!blocks);

  Messages messages = {0};
  assert(resize(&messages, 3) && blocks == 1 && messages.size == 3 && messages.capacity == 3);
  assert(length(&messages) == 3 && in_sequence(&messages, 2) == messages.data + 2);
  assert(in_array(&zero, 5) == &zero + 5);
  fill(messages.data), fill(messages.data + 2);
  assert(resize(&messages, 1) && blocks == 1 && messages.size == 1);
  assert(!memcmp(messages.data, &zero, sizeof zero));
  assert(!resize(&messages, 1000) && !blocks && !messages.data && !length(&messages));
  assert(resize(&messages, 0) && !blocks);
  return 0;
}
