// Ownership of the objects of C libraries.
#pragma once

namespace lightwell {

/// Deleter of a std::unique_ptr that calls the function `Free`; for example
///   std::unique_ptr<BIO, Deleter<BIO_free_all>>
template <auto Free>
struct Deleter {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};

}  // namespace lightwell
