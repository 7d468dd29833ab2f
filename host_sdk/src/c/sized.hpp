// Structs whose size the caller tells: older and newer applications have shorter and longer ones.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

#include "c/call.hpp"

namespace lightwell::c {

/// Larger is no struct of any version, but a `size` that nobody set.
inline constexpr std::uint32_t kMaxStructSize = 4096;

/// invalid_argument where `given` is NULL or its size is none; `name` as the header spells it.
template <class T>
Status size_of(const T* given, const char* name, std::uint32_t& size) {
  if (given == nullptr) return invalid(std::string(name) + " is NULL");
  std::memcpy(&size, given, sizeof size);
  if (size < 2 * sizeof size || size > kMaxStructSize)
    return invalid(std::string(name) + ".size is " + std::to_string(size) + "; set it to sizeof(" + name +
                   ") before the call");
  return {};
}

/// What a shorter struct lacks stays as `into` has it; of a longer one the unknown part must be zero.
template <class T>
Status read_sized(const T* given, const char* name, T& into) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::uint32_t size = 0;
  if (Status status = size_of(given, name, size); !status.ok()) return status;
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = sizeof(T); i < size; ++i)
    if (bytes[i] != 0)
      return invalid(std::string(name) + ": this library knows its first " + std::to_string(sizeof(T)) + " bytes of " +
                     std::to_string(size) + ", and what follows asks for something; is an older " +
                     "liblightwell loaded than the application was compiled with?");
  std::memcpy(&into, given, std::min<std::size_t>(size, sizeof(T)));
  into.size = sizeof(T);
  return {};
}

/// Fills as much as the caller has; what the library does not know becomes zero. `size` stays the caller's.
template <class T>
Status write_sized(const T& from, const char* name, T* to) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::uint32_t size = 0;
  if (Status status = size_of(to, name, size); !status.ok()) return status;
  constexpr std::size_t kHead = sizeof size;
  auto* bytes = reinterpret_cast<unsigned char*>(to);
  const std::size_t known = std::min<std::size_t>(size, sizeof(T));
  std::memcpy(bytes + kHead, reinterpret_cast<const unsigned char*>(&from) + kHead, known - kHead);
  std::memset(bytes + known, 0, size - known);
  return {};
}

/// What a failed call leaves in an answer: nothing that could be taken for light by who does not look at the status.
template <class T>
lw_status refused(lw_status status, const char* name, T* out) {
  if (status == LW_OK || out == nullptr) return status;
  T none{};
  none.validity = LW_INVALID_QUERY;
  if constexpr (requires { none.reason; }) none.reason = "the call failed: lw_last_error says why";
  // The reason to tell is the call's, also where `out` is the very thing that is wrong.
  (void)write_sized(none, name, out);
  return status;
}

}  // namespace lightwell::c
