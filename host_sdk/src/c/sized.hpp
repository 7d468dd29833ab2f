// Versioned structs of the C ABI: the caller sets `size`, which differs between versions of the header.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

#include "c/call.hpp"

namespace lightwell::c {

/// A larger `size` was not set by the caller.
inline constexpr std::uint32_t kMaxStructSize = 4096;

/// Reads `size`. invalid_argument if `given` is NULL or the size is invalid; `name` is the struct's name in the header.
template <class T>
Status size_of(const T* given, const char* name, std::uint32_t& size) {
  if (given == nullptr) return invalid(std::string(name) + " is NULL");
  std::memcpy(&size, given, sizeof size);
  if (size < 2 * sizeof size || size > kMaxStructSize)
    return invalid(std::string(name) + ".size is " + std::to_string(size) + "; set it to sizeof(" + name +
                   ") before the call");
  return {};
}

/// Reads a struct. Fields that a shorter struct lacks keep their values in `into`; the unknown part of a longer one
/// must be zero.
template <class T>
Status read_sized(const T* given, const char* name, T& into) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::uint32_t size = 0;
  if (Status status = size_of(given, name, size); !status.ok()) return status;
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = sizeof(T); i < size; ++i)
    if (bytes[i] != 0)
      return invalid(std::string(name) + ": this library knows its first " + std::to_string(sizeof(T)) + " bytes of " +
                     std::to_string(size) + ", and the rest is not zero; is an older liblightwell loaded than the " +
                     "application was compiled with?");
  std::memcpy(&into, given, std::min<std::size_t>(size, sizeof(T)));
  into.size = sizeof(T);
  return {};
}

/// Writes a struct up to the caller's size; fields unknown to the library become zero. `size` is kept.
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

/// After a failed call, fills the output with an invalid answer, so that a caller who ignores the status finds no
/// light.
template <class T>
lw_status write_failure(lw_status status, const char* name, T* out) {
  if (status == LW_OK || out == nullptr) return status;
  T none{};
  none.validity = LW_INVALID_QUERY;
  if constexpr (requires { none.reason; }) none.reason = "the call failed: lw_last_error says why";
  // The status of the call is returned, even if `out` itself is invalid.
  (void)write_sized(none, name, out);
  return status;
}

}  // namespace lightwell::c
