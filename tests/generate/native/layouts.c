/* Reads a library's tables with a distribution's C structures, and compares them with structures
 * of messages that the same compiler lays out: native_layouts LIBRARY. The test writes
 * `expected.h`, and defines KEYS and BUFFERS for the distributions that have them. Compiled as C++,
 * it reads the tables for C++.
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

#ifdef __cplusplus
#include <string>
#include <vector>
typedef std::string Text;
#define PRIMITIVES(type) std::vector<type>
#define MESSAGES(type) std::vector<type>
static const char IDENTIFIER[] = "rosidl_typesupport_introspection_cpp";
static const char FIELDS[] = "rosidl_typesupport_introspection_cpp";
#define SEPARATOR "::"
#else
typedef struct { void *data; size_t size, capacity; } Text;
typedef struct { void *data; size_t size, capacity; } Messages;
typedef struct {
  void *data;
  size_t size, capacity;
#ifdef BUFFERS
  bool is_rosidl_buffer, owns_rosidl_buffer;
#endif
} Primitives;
#define PRIMITIVES(type) Primitives
#define MESSAGES(type) Messages
static const char IDENTIFIER[] = "rosidl_typesupport_cpp";
static const char FIELDS[] = "rosidl_typesupport_introspection_c";
#define SEPARATOR "__"
#endif

typedef struct { const char *name; int type, bound, array, count, upper; size_t offset; } Expected;

#include "expected.h" /* structures, EXPECTED: {name, size, fields, how many} */

static int compare(const Members *found, int message)
{
  const Expected *fields = EXPECTED[message].fields;
  if (strcmp(found->name, EXPECTED[message].name) || strcmp(found->space, PACKAGE SEPARATOR "msg")) return 1;
  if (found->size != EXPECTED[message].size || found->count != EXPECTED[message].count) return 2;
#ifdef __cplusplus
  if (!found->init || !found->fini) return 3;
#else
  if (found->init || found->fini) return 3;
#endif
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

/* Fast DDS has nothing to serialize with, and finds zeros in whatever else it reads. */
static int check_codec(const Codec *codec)
{
  char bounds = 7;
  if (codec->serialize(0, 0) || codec->most(&bounds) || bounds) return 1;
#ifdef KEYS
  if (codec->key) return 2;
#endif
#ifdef BUFFERS
  if (codec->has_buffer_fields || codec->with_endpoint[0]) return 3;
#endif
  return 0;
}

int main(int count, char **words)
{
  void *library = count == 2 ? dlopen(words[1], RTLD_NOW) : NULL;
  if (!library) return puts(count == 2 ? dlerror() : "wrong words"), 1;
  for (size_t i = 0; i < sizeof EXPECTED / sizeof *EXPECTED; i++) {
    char symbol[300];
    const char *start = "get_message_type_support_handle__" PACKAGE "__msg";
    snprintf(symbol, sizeof symbol, "%s__%s__%s", IDENTIFIER, start, EXPECTED[i].name);
    const Handle *(*get)(void) = (const Handle *(*)(void)) dlsym(library, symbol);
    if (!get) return puts(dlerror()), 1;
    const Handle *handle = get();
    int wrong = compare((const Members *) handle->func(handle, FIELDS)->data, i);
    if (wrong) return printf("%s: %d\n", EXPECTED[i].name, wrong), 1;
    const Handle *fast = handle->func(handle, "rosidl_typesupport_fastrtps_c");
    wrong = fast ? check_codec((const Codec *) fast->data) : strcmp(IDENTIFIER, FIELDS);
    if (wrong) return printf("%s: codec: %d\n", EXPECTED[i].name, wrong), 1;
  }
  return 0;
}
