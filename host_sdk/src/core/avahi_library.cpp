#include "core/avahi_library.hpp"

#include <dlfcn.h>
#include <string>

namespace lightwell::core {
namespace {

/// The interface that this file was compiled for; Avahi has kept it since version 0.6.
constexpr const char* kName = "libavahi-client.so.3";

Status last_error() {
  const char* text = ::dlerror();
  return {StatusCode::unavailable, text != nullptr ? text : kName};
}

Result<AvahiLibrary> load() {
  void* const library = ::dlopen(kName, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return last_error();
  AvahiLibrary functions{};
#define LIGHTWELL_AVAHI_LOOKUP(name)                                                             \
  functions.name = reinterpret_cast<decltype(functions.name)>(::dlsym(library, "avahi_" #name)); \
  if (functions.name == nullptr) return last_error();
  LIGHTWELL_AVAHI_FUNCTIONS(LIGHTWELL_AVAHI_LOOKUP)
#undef LIGHTWELL_AVAHI_LOOKUP
  return functions;
}

}  // namespace

const Result<AvahiLibrary>& AvahiLibrary::loaded() {
  // Never destroyed: threads of a static Probe may still use it while the process exits.
  static const auto* const library = new Result<AvahiLibrary>(load());
  return *library;
}

}  // namespace lightwell::core
