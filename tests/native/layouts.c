/* Reads a library's tables with a distribution's C structures, and compares them with structures
 * of messages that the same compiler lays out: native_layouts LIBRARY PACKAGE. The test writes
 * `expected.h`, and defines KEYS and BUFFERS for the distributions that have them.
 */
#include <dlfcn.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef struct Handle {
  const char *identifier;
  const void *data;
  const struct Handle *(*func)(const struct Handle *, const char *);
} Handle;

typedef struct {
  const char *name;
  uint8_t type_id;
  size_t string_upper_bound;
  const Handle *members;
#ifdef KEYS
  bool is_key;
#endif
  bool is_array;
  size_t array_size;
  bool is_upper_bound;
  uint32_t offset;
  const void *default_value;
  void *functions[6];
#ifdef BUFFERS
  bool is_rosidl_buffer;
#endif
} Member;

typedef struct {
  const char *space, *name;
  uint32_t count;
  size_t size;
#ifdef KEYS
  bool has_any_key;
#endif
  const Member *members;
  void (*init)(void *, int), (*fini)(void *);
} Members;

typedef struct {
  const char *space, *name;
  bool (*serialize)(const void *, void *), (*deserialize)(void *, void *);
  uint32_t (*size)(const void *);
  size_t (*most)(char *);
#ifdef KEYS
  void *key;
#endif
#ifdef BUFFERS
  bool has_buffer_fields;
  void *with_endpoint[2];
#endif
} Codec;

typedef struct { void *data; size_t size, capacity; } Text;
typedef struct { void *data; size_t size, capacity; } Messages;
typedef struct {
  void *data;
  size_t size, capacity;
#ifdef BUFFERS
  bool is_rosidl_buffer, owns_rosidl_buffer;
#endif
} Primitives;

typedef struct { const char *name; int type, bound, array, count, upper; size_t offset; } Expected;

#include "expected.h" /* structures, MESSAGES: {name, size, fields, how many} */

static const char FIELDS[] = "rosidl_typesupport_introspection_c";

static int compare(const Members *found, int message)
{
  const Expected *fields = MESSAGES[message].fields;
  if (strcmp(found->name, MESSAGES[message].name) || strcmp(found->space, SPACE)) return 1;
  if (found->size != MESSAGES[message].size || found->count != MESSAGES[message].count) return 2;
  if (found->init || found->fini) return 3;
  for (uint32_t i = 0; i < found->count; i++) {
    const Member *one = found->members + i;
    const Expected *other = fields + i;
    if (strcmp(one->name, other->name)) return 1000 + i;
    if (one->type_id != other->type || one->string_upper_bound != (size_t) other->bound) return 2000 + i;
    if (one->is_array != other->array || one->array_size != (size_t) other->count) return 3000 + i;
    if (one->is_upper_bound != other->upper || one->offset != other->offset) return 4000 + i;
    if (one->default_value || !one->members != (one->type_id != 18)) return 5000 + i;
    if (one->members && one->members->func(one->members, FIELDS) != one->members) return 6000 + i;
#ifdef KEYS
    if (one->is_key) return 7000 + i;
#endif
#ifdef BUFFERS
    if (one->is_rosidl_buffer) return 8000 + i;
#endif
  }
  return 0;
}

int main(int count, char **words)
{
  void *library = count == 3 ? dlopen(words[1], RTLD_NOW) : NULL;
  if (!library) return puts(count == 3 ? dlerror() : "wrong words"), 1;
  for (size_t i = 0; i < sizeof MESSAGES / sizeof *MESSAGES; i++) {
    char symbol[300];
    const char *start = "rosidl_typesupport_cpp__get_message_type_support_handle";
    snprintf(symbol, sizeof symbol, "%s__%s__msg__%s", start, words[2], MESSAGES[i].name);
    const Handle *(*get)(void) = (const Handle *(*)(void)) dlsym(library, symbol);
    if (!get) return puts(dlerror()), 1;
    const Handle *handle = get();
    int wrong = compare(handle->func(handle, FIELDS)->data, i);
    if (wrong) return printf("%s: %d\n", MESSAGES[i].name, wrong), 1;
    const Codec *codec = handle->func(handle, "rosidl_typesupport_fastrtps_c")->data;
    char bounds = 7;
    if (codec->serialize(0, 0) || codec->most(&bounds) || bounds) return puts("codec"), 1;
#ifdef KEYS
    if (codec->key) return puts("key"), 1;
#endif
#ifdef BUFFERS
    if (codec->has_buffer_fields || codec->with_endpoint[0]) return puts("buffers"), 1;
#endif
  }
  return 0;
}
