/* What an introspection-based middleware does with message memory, as Cyclone DDS does it: it walks
 * over the members, turns memory into CDR and CDR into memory, and calls the functions that stand
 * beside the members.
 *
 * All of it happens in a thread of its own, while the thread that asked for it waits with Python's
 * lock in its hand. So a function that needs that lock is found out at once: nothing comes back.
 *
 * OTHER_VERSION: with the tables of another version of ROS 2 than the installed one; it has KEYS
 * from Jazzy on, BUFFERS from Lyrical on.
 */
#define _GNU_SOURCE
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#include "rosidl_runtime_c/primitives_sequence.h"
#include "rosidl_runtime_c/string_functions.h"
#include "rosidl_runtime_c/u16string_functions.h"
#include "rosidl_typesupport_introspection_c/field_types.h"
#include "rosidl_typesupport_introspection_c/message_introspection.h"

#ifdef OTHER_VERSION
typedef struct {
  const char *name_;
  uint8_t type_id_;
  size_t string_upper_bound_;
  const rosidl_message_type_support_t *members_;
#ifdef KEYS
  bool is_key_;
#endif
  bool is_array_;
  size_t array_size_;
  bool is_upper_bound_;
  uint32_t offset_;
  const void *default_value_;
  size_t (*size_function)(const void *);
  const void *(*get_const_function)(const void *, size_t);
  void *(*get_function)(void *, size_t);
  void (*fetch_function)(const void *, size_t, void *);
  void (*assign_function)(void *, size_t, const void *);
  bool (*resize_function)(void *, size_t);
#ifdef BUFFERS
  bool is_rosidl_buffer_;
#endif
} Member;

typedef struct {
  const char *message_namespace_, *message_name_;
  uint32_t member_count_;
  size_t size_of_;
#ifdef KEYS
  bool has_any_key_member_;
#endif
  const Member *members_;
  void (*init_function)(void *, int), (*fini_function)(void *);
} Members;
#else
typedef rosidl_typesupport_introspection_c__MessageMembers Members;
typedef rosidl_typesupport_introspection_c__MessageMember Member;
#endif

enum { BLOCKED = -1, WRONG = 0, DONE = 1, PATIENCE = 20 };

typedef struct {
  const Members *members;
  char *memory;
  char *data;      /* CDR without header */
  size_t at, size; /* how far it is read or written, and how long it may be */
  bool filling;    /* from CDR to memory, or the other way */
  int result;
} Work;

static bool move(Work *work, void *value, size_t size, size_t align) {
  size_t start = (work->at + align - 1) / align * align;
  if (start + size > work->size) return false;
  memset(work->data + work->at, 0, work->filling ? 0 : start - work->at);
  work->at = start + size;
  if (work->filling) memcpy(value, work->data + start, size);
  else memcpy(work->data + start, value, size);
  return true;
}

static bool move_text(Work *work, rosidl_runtime_c__String *text) {
  if (!work->filling && (text->capacity <= text->size || text->data[text->size])) return false;
  uint32_t count = text->size + 1;
  if (!move(work, &count, 4, 4)) return false;
  if (!work->filling) return move(work, text->data, count, 1);
  char *from = work->data + work->at;
  work->at += count;
  return work->at <= work->size && rosidl_runtime_c__String__assignn(text, from, count - 1);
}

static bool move_wide_text(Work *work, rosidl_runtime_c__U16String *text) {
  uint32_t count = text->size;
  if (!move(work, &count, 4, 4) || work->at + 4 * (size_t) count > work->size) return false;
  if (work->filling && !rosidl_runtime_c__U16String__resize(text, count)) return false;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t unit = text->data[i];
    if (!move(work, &unit, 4, 4)) return false;
    text->data[i] = unit;
  }
  return true;
}

static bool move_message(Work *work, const Members *members, char *memory);

static size_t size_of(const Member *member) {
  switch (member->type_id_) {
    case rosidl_typesupport_introspection_c__ROS_TYPE_STRING:
      return sizeof(rosidl_runtime_c__String);
    case rosidl_typesupport_introspection_c__ROS_TYPE_WSTRING:
      return sizeof(rosidl_runtime_c__U16String);
    case rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE:
      return ((const Members *) member->members_->data)->size_of_;
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT16:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT16:
      return 2;
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT32:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT32:
    case rosidl_typesupport_introspection_c__ROS_TYPE_FLOAT:
      return 4;
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT64:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT64:
    case rosidl_typesupport_introspection_c__ROS_TYPE_DOUBLE:
      return 8;
    default:
      return 1;
  }
}

static bool move_one(Work *work, const Member *member, void *value) {
  switch (member->type_id_) {
    case rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE:
      return move_message(work, member->members_->data, value);
    case rosidl_typesupport_introspection_c__ROS_TYPE_STRING:
      return move_text(work, value);
    case rosidl_typesupport_introspection_c__ROS_TYPE_WSTRING:
      return move_wide_text(work, value);
    default: {
      size_t size = size_of(member);
      return (uintptr_t) value % size == 0 && move(work, value, size, size);
    }
  }
}

static bool move_array(Work *work, const Member *member, void *field) {
  size_t count = member->array_size_;
  char *first = field;
  if (!count || member->is_upper_bound_) {
    const rosidl_runtime_c__uint8__Sequence *sequence = field;
    uint32_t told = sequence->size;
    if (member->size_function(field) != told || sequence->capacity < told) return false;
    if (!move(work, &told, 4, 4)) return false;
    count = told;
    /* twice, as for memory that is used again */
    if (work->filling && !member->resize_function(field, count + 2)) return false;
    if (work->filling && !member->resize_function(field, count)) return false;
    first = (char *) sequence->data;
  }
  for (size_t i = 0; i < count; i++) {
    char *element = member->get_function(field, i);
    if (element != first + i * size_of(member)) return false;
    if (element != member->get_const_function(field, i)) return false;
    if (!move_one(work, member, element)) return false;
  }
  return true;
}

static bool move_message(Work *work, const Members *members, char *memory) {
  for (uint32_t i = 0; i < members->member_count_; i++) {
    const Member *member = members->members_ + i;
    bool (*move_it)(Work *, const Member *, void *) = member->is_array_ ? move_array : move_one;
    if (!move_it(work, member, memory + member->offset_)) return false;
  }
  return true;
}

static void *run(void *argument) {
  Work *work = argument;
  bool moved = move_message(work, work->members, work->memory);
  work->result = moved && (!work->filling || work->at == work->size) ? DONE : WRONG;
  return NULL;
}

/* Fill memory from `size` bytes of CDR, or write the CDR of what memory holds into them. */
int walk(const Members *members, char *memory, char *data, size_t *size, bool filling) {
  static Work work; /* outlives a thread that is blocked */
  work = (Work) {members, memory, data, 0, *size, filling, WRONG};
  struct timespec end;
  pthread_t thread;
  if (pthread_create(&thread, NULL, run, &work)) return WRONG;
  clock_gettime(CLOCK_REALTIME, &end);
  end.tv_sec += PATIENCE;
  if (pthread_timedjoin_np(thread, NULL, &end)) return BLOCKED;
  *size = work.at;
  return work.result;
}
