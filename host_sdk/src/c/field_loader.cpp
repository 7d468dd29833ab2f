// Loads the module of the light field.
#include <cstring>
#include <dlfcn.h>
#include <string>

#include "c/call.hpp"
#include "c/field_module.hpp"

namespace lightwell::c {
namespace {

constexpr const char* kFieldFile = "lightwell/lightwell_field.so";

Status missing_field(const std::string& reason) {
  return {StatusCode::failed_precondition,
          reason + "; install the light field of this version of Lightwell (Debian: lightwell-tools) as " + kFieldFile +
              " in the folder of liblightwell.so"};
}

Result<const FieldEntry*> load_field() {
  Dl_info own{};
  if (::dladdr(reinterpret_cast<const void*>(&field_module), &own) == 0 || own.dli_fname == nullptr)
    return missing_field("the folder of liblightwell.so is not known");
  const std::string library = own.dli_fname;
  const std::string path = library.substr(0, library.rfind('/') + 1) + kFieldFile;
  void* const module = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) {
    const char* const text = ::dlerror();
    return missing_field(text != nullptr ? text : path + " cannot be loaded");
  }
  const auto* entry = static_cast<const FieldEntry*>(::dlsym(module, "lightwell_field_entry"));
  if (entry == nullptr || std::strcmp(entry->version, kFieldVersion) != 0)
    return missing_field(path + " is of another version than liblightwell.so");
  return entry;
}

}  // namespace

const Result<const FieldEntry*>& field_module() {
  // Never destroyed: threads may still use it while the process exits.
  static const auto* const entry = new Result<const FieldEntry*>(load_field());
  return *entry;
}

}  // namespace lightwell::c
