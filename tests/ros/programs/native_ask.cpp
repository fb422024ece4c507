/* Loads type support as rclcpp and rosbag2 do, asks for what middlewares ask for, and prints it:
 * native_ask NAME..., where AMENT_PREFIX_PATH says where packages are.
 */
#include <dlfcn.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "rosidl_runtime_c/message_type_support_struct.h"
#include "rosidl_runtime_c/type_description/type_description__struct.h"
#include "rosidl_runtime_c/type_description/type_source__struct.h"
#include "rosidl_typesupport_fastrtps_cpp/message_type_support.h"
#include "rosidl_typesupport_introspection_c/message_introspection.h"
#include "rosidl_typesupport_introspection_cpp/message_introspection.hpp"

using Handle = rosidl_message_type_support_t;
namespace cpp = rosidl_typesupport_introspection_cpp;

static const char OWN[] = "rosidl_typesupport_cpp";
static const char FAST[] = "rosidl_typesupport_fastrtps_c";
static const char FIELDS[] = "rosidl_typesupport_introspection_c";
static const char FIELDS_CPP[] = "rosidl_typesupport_introspection_cpp";

#define CHECK(condition) \
  do if (!(condition)) { \
    std::fprintf(stderr, "%s: line %d: %s\n", name.c_str(), __LINE__, #condition); \
    std::exit(1); \
  } while (false)

static std::string prefix_of(const std::string & package)
{
  std::stringstream prefixes(std::getenv("AMENT_PREFIX_PATH"));
  for (std::string one; std::getline(prefixes, one, ':');) {
    std::string file = one + "/share/ament_index/resource_index/packages/" + package;
    if (access(file.c_str(), R_OK) == 0) return one;
  }
  throw std::runtime_error("no package " + package);
}

static void * open_library(const std::string & name, const char * identifier, int mode)
{
  std::string package = name.substr(0, name.find('/'));
  std::string path = prefix_of(package) + "/lib/lib" + package + "__" + identifier + ".so";
  void * library = dlopen(path.c_str(), mode);
  if (!library) throw std::runtime_error(dlerror());
  return library;
}

static const Handle * handle_of(void * library, std::string name, const char * identifier)
{
  for (size_t at; (at = name.find('/')) != std::string::npos;) name.replace(at, 1, "__");
  std::string symbol = std::string(identifier) + "__get_message_type_support_handle__" + name;
  auto get = reinterpret_cast<const Handle * (*)()>(dlsym(library, symbol.c_str()));
  if (!get) throw std::runtime_error(dlerror());
  return get();
}

template<typename Members>
static void show(const Members * members, int depth)
{
  std::printf("%*s%s %s %zu:\n", depth, "", members->message_namespace_, members->message_name_,
    members->size_of_);
  for (uint32_t i = 0; i < members->member_count_; i++) {
    const auto & member = members->members_[i];
    std::printf("%*s- %s %d %zu %d %zu %d %u\n", depth, "", member.name_, member.type_id_,
      member.string_upper_bound_, member.is_array_, member.array_size_, member.is_upper_bound_,
      member.offset_);
    if (member.members_) show(static_cast<const Members *>(member.members_->data), depth + 2);
  }
}

static void ask(const std::string & name, Handle handle)
{
  CHECK(!std::strcmp(handle.typesupport_identifier, OWN));
  const Handle * fields = handle.func(&handle, FIELDS);
  const Handle * fast = handle.func(&handle, FAST);
  // Fast DDS compares pointers
  CHECK(fields && fields->typesupport_identifier == FIELDS);
  CHECK(fast && fast->typesupport_identifier == FAST);
  CHECK(handle.func(&handle, OWN));
  std::string like(FAST);
  for (const auto & other : {std::string(), std::string("x"), like + "pp", like + " ",
      like.substr(0, like.size() - 1), std::string(FIELDS_CPP)})
  {
    CHECK(!handle.func(&handle, other.c_str()));
    CHECK(!fields->func(fields, other.c_str()));
    CHECK(!fast->func(fast, other.c_str()));
  }
  CHECK(fields->func(fields, FIELDS) == fields);
  CHECK(fast->func(fast, FAST) == fast);
  auto codec = static_cast<const message_type_support_callbacks_t *>(fast->data);
  auto & cdr = *reinterpret_cast<eprosima::fastcdr::Cdr *>(16);  // nobody looks
  CHECK(!codec->cdr_serialize(nullptr, cdr) && !codec->cdr_deserialize(cdr, nullptr));
  char bounds = 7;
  CHECK(!codec->get_serialized_size(nullptr) && !codec->max_serialized_size(bounds));
  CHECK(!bounds && !codec->key_callbacks);
}

static void look(const std::string & name, Handle handle)
{
  auto codec = static_cast<const message_type_support_callbacks_t *>(
    handle.func(&handle, FAST)->data);
  std::printf("%s %s::%s ", name.c_str(), codec->message_namespace_, codec->message_name_);
  const rosidl_type_hash_t * hash = handle.get_type_hash_func(&handle);
  for (int value : hash->value) std::printf("%02x", value);
  auto description = handle.get_type_description_func(&handle);
  auto sources = handle.get_type_description_sources_func(&handle);
  std::printf(" %s %zu\n", description->type_description.type_name.data, sources->size);
  for (size_t i = 0; i < sources->size; i++) {
    const auto & source = sources->data[i];
    std::printf("  %s %s %zu\n", source.type_name.data, source.encoding.data,
      source.raw_file_contents.size);
  }
  const Handle * fields = handle.func(&handle, FIELDS);
  show(static_cast<const rosidl_typesupport_introspection_c__MessageMembers *>(fields->data), 2);
}

/* What plotting tools read, and what nobody may do: C++ has no memory for these types. */
static void look_at_fields(const std::string & name, int mode)
{
  void * library = open_library(name, FIELDS_CPP, mode);
  const Handle * handle = handle_of(library, name, FIELDS_CPP);
  CHECK(handle->func(handle, FIELDS_CPP) == handle && !handle->func(handle, FIELDS));
  auto members = static_cast<const cpp::MessageMembers *>(handle->data);
  show(members, 2);
  char memory[8] = {0};
  int caught = 0;
  for (int i = 0; i < 100; i++) {
    try {
      members->init_function(memory, rosidl_runtime_cpp::MessageInitialization::ZERO);
    } catch (const std::runtime_error & error) {
      caught += std::string(error.what()).find(name) == 0;
    }
  }
  CHECK(caught == 100);
  members->fini_function(memory);
  dlclose(library);
}

int main(int count, char ** words)
{
  const int modes[] = {RTLD_LAZY, RTLD_NOW, RTLD_LAZY | RTLD_GLOBAL, RTLD_NOW | RTLD_GLOBAL};
  std::vector<std::string> names(words + 1, words + count);
  for (int mode : modes) {
    std::map<std::string, Handle> copies;  // as rclcpp has them
    std::vector<void *> libraries;
    for (const auto & name : names) {
      libraries.push_back(open_library(name, OWN, mode));
      copies[name] = *handle_of(libraries.back(), name, OWN);
      ask(name, copies[name]);
    }
    for (void * library : libraries) if (dlclose(library)) return 1;
    for (const auto & [name, handle] : copies) {
      ask(name, handle);  // rclcpp uses them for longer than it keeps the library open
      if (mode == modes[0]) {
        look(name, handle);
        look_at_fields(name, mode);
      }
    }
  }
  std::printf("asked for %zu\n", names.size());
}
