/* Runs the machine code of idlc/runtime/fastrtps.py: machine_code_fastrtps FILE ENTRY...
 *
 * FILE is the code without its words.
 */
#include <assert.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef struct { char head[24]; size_t words[7]; } Spans;
typedef struct { void *head[2]; size_t length; char text[16]; } Bytes;
typedef struct { void *head[3]; Spans *spans; void *received; Bytes *body; } Memory;
typedef struct { char *other[2]; char *position, *origin; char *end; } Cdr;

static char made[16];
static size_t made_size;
static void *forgotten;
static int cleared;

static void *new_bytes(const char *start, size_t size) {
  if (size > sizeof made) return NULL;
  memcpy(made, start, made_size = size);
  return made;
}

static void forget(void *object) { forgotten = object; }

static void clear_error(void) { cleared++; }

static void *make(void *type) { return type; }

int main(int count, char **words) {
  assert(count == 8);
  int first, second;
  void *answers[] = {"one", &first, "once", &second, NULL};
  size_t values[] = {(size_t) memcpy, (size_t) new_bytes, (size_t) forget, (size_t) clear_error,
                     offsetof(Cdr, position), offsetof(Cdr, end), offsetof(Memory, spans),
                     offsetof(Memory, received), offsetof(Spans, words),
                     offsetof(Memory, body), offsetof(Bytes, length), (size_t) answers,
                     (size_t) &second, (size_t) make};
  int file = open(words[1], O_RDWR);
  off_t end = lseek(file, 0, SEEK_END);
  assert(write(file, values, sizeof values) == sizeof values);
  char *code = mmap(NULL, end + sizeof values, PROT_READ | PROT_EXEC, MAP_PRIVATE, file, 0);
  assert(code != MAP_FAILED);
  void *entry[6];
  for (int i = 0; i < 6; i++) entry[i] = code + atoi(words[2 + i]);
  bool (*serialize)(Memory *, Cdr *) = entry[0], (*deserialize)(Cdr *, Memory *) = entry[1];
  size_t (*serialized_size)(Memory *) = entry[2], (*maximum_size)(char *) = entry[3];
  void *(*resolve)(void *, char *) = entry[4], *(*create)(void) = entry[5];

  char buffer[] = "....................", bounds = 7;
  Cdr cdr = {.position = buffer + 4, .end = buffer + 11};
  Memory memory = {0};
  assert(!serialize(&memory, &cdr) && !serialized_size(&memory));
  Spans spans = {"", {7, (size_t) "abc", 3, (size_t) "", 0, (size_t) "defg", 4}};
  memory.spans = &spans;
  assert(serialized_size(&memory) == 7);
  assert(serialize(&memory, &cdr) && cdr.position == buffer + 11);
  assert(!strcmp(buffer, "....abcdefg........."));
  cdr.position = buffer + 5;
  assert(!serialize(&memory, &cdr) && cdr.position == buffer + 5);
  spans.words[0] = 0;
  assert(serialize(&memory, &cdr) && cdr.position == buffer + 5);
  assert(!strcmp(buffer, "....abcdefg........."));

  Bytes body = {{0}, 4 + 5, "headHALLO"};
  Memory whole = {.body = &body};
  assert(offsetof(Bytes, text) == offsetof(Spans, words));
  assert(serialized_size(&whole) == 5);
  cdr.position = buffer + 7;
  assert(!serialize(&whole, &cdr) && cdr.position == buffer + 7);
  cdr.position = buffer + 6;
  assert(serialize(&whole, &cdr) && cdr.position == buffer + 11);
  assert(!strcmp(buffer, "....abHALLO........."));
  cdr.position = buffer + 5;
  assert(create() == &second);

  memory.received = &first;
  assert(deserialize(&cdr, &memory) && memory.received == made && forgotten == &first);
  assert(made_size == 10 && !memcmp(made, buffer + 1, 10) && cdr.position == buffer + 5);
  cdr.end = buffer + 20;
  assert(!deserialize(&cdr, &memory) && cleared == 1 && memory.received == made);

  assert(maximum_size(&bounds) == 0 && bounds == 0);
  assert(resolve(NULL, "one") == &first && resolve(NULL, "once") == &second);
  assert(!resolve(NULL, "on") && !resolve(NULL, "ones") && !resolve(NULL, "onces"));
  assert(!resolve(NULL, "") && !resolve(NULL, "two"));
  return 0;
}
