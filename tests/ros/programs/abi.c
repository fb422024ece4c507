/* Introspection tables of two messages of rcl_interfaces, as each version of ROS 2 has them.
 *
 * KEYS is defined from Jazzy on, BUFFERS from Lyrical on. With PLAIN_STRINGS, sequences of strings
 * have three members there as well.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct { void *data; size_t size, capacity; } Messages;
#ifdef BUFFERS
typedef struct { void *data; size_t size, capacity; bool is_rosidl_buffer, owns; } Numbers;
#else
typedef Messages Numbers;
#endif
#ifdef PLAIN_STRINGS
typedef Messages Strings;
#else
typedef Numbers Strings;
#endif

typedef struct {
  uint8_t type;
  bool bool_value;
  int64_t integer_value;
  double double_value;
  Messages string_value; /* a string has three words, too */
  Numbers byte_array_value, bool_array_value, integer_array_value, double_array_value;
  Strings string_array_value;
} ParameterValue;

typedef struct {
  Strings names, prefixes;
} ListParametersResult;

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
  void (*functions[6])(void);
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
  Member *members;
  void (*init)(void), (*fini)(void);
} Members;

static void function(void) {}
static const Handle *same(const Handle *handle, const char *identifier) {
  (void) identifier;
  return handle;
}

#define OF(id, owner, field) .name = #field, .type_id = id, .offset = offsetof(owner, field)
#define ONE(id, field) {OF(id, ParameterValue, field)}
#define MANY(id, owner, field) \
  {OF(id, owner, field), .is_array = true, \
   .functions = {function, function, function, function, function, function}}
#define TABLE(owner, rows) \
  {.space = "rcl_interfaces__msg", .name = #owner, .count = sizeof rows / sizeof *rows, \
   .size = sizeof(owner), .members = rows, .init = function, .fini = function}

Member value_members[] = {
  ONE(8, type),
  ONE(6, bool_value),
  ONE(15, integer_value),
  ONE(2, double_value),
  ONE(16, string_value),
  MANY(7, ParameterValue, byte_array_value),
  MANY(6, ParameterValue, bool_array_value),
  MANY(15, ParameterValue, integer_array_value),
  MANY(2, ParameterValue, double_array_value),
  MANY(16, ParameterValue, string_array_value),
};
Member list_members[] = {
  MANY(16, ListParametersResult, names),
  MANY(16, ListParametersResult, prefixes),
};
Members value_table = TABLE(ParameterValue, value_members);
Members list_table = TABLE(ListParametersResult, list_members);
Handle value_handle = {"rosidl_typesupport_introspection_c", &value_table, same};
Handle list_handle = {"rosidl_typesupport_introspection_c", &list_table, same};

size_t sizes[] = {
  sizeof value_handle, sizeof value_table, sizeof value_members,
  sizeof list_handle, sizeof list_table, sizeof list_members,
};

#define GETTER(name) \
  rosidl_typesupport_introspection_c__get_message_type_support_handle__rcl_interfaces__msg__##name
const Handle *GETTER(ParameterValue)(void) { return &value_handle; }
const Handle *GETTER(ListParametersResult)(void) { return &list_handle; }
