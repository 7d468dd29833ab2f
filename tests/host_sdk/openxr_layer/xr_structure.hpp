// OpenXR's structures in tests.
#pragma once

#include <openxr/openxr.h>

namespace lightwell::test {

/// Zero, but for its type and chain.
template <class T>
T structure(XrStructureType type, void* next = nullptr) {
  T out{};
  out.type = type;
  out.next = static_cast<decltype(out.next)>(next);
  return out;
}

}  // namespace lightwell::test
