// Status and Result: error reporting of all Lightwell libraries. Nothing here throws.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace lightwell {

enum class StatusCode : std::uint8_t {
  ok,
  invalid_argument,     ///< The caller's input can never work; the message says what and where.
  not_found,            ///< A file, a device or a probe does not exist.
  data_loss,            ///< Input is truncated or damaged.
  failed_precondition,  ///< Not possible in the current state; the message says what is required.
  unavailable,          ///< A peer or a device cannot be reached; a retry may succeed.
  resource_exhausted,   ///< A limit is reached, a disk is full, a port is in use.
  internal,             ///< A defect of Lightwell or of a library below it.
};

/// The name of a code as it is written in messages and JSON, "invalid_argument".
[[nodiscard]] constexpr std::string_view to_string(StatusCode code) {
  switch (code) {
    case StatusCode::ok:
      return "ok";
    case StatusCode::invalid_argument:
      return "invalid_argument";
    case StatusCode::not_found:
      return "not_found";
    case StatusCode::data_loss:
      return "data_loss";
    case StatusCode::failed_precondition:
      return "failed_precondition";
    case StatusCode::unavailable:
      return "unavailable";
    case StatusCode::resource_exhausted:
      return "resource_exhausted";
    case StatusCode::internal:
      return "internal";
  }
  return "unknown";
}

/// Success, or an error code with a message that says what is wrong, where, and what to do.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

  [[nodiscard]] bool ok() const { return code_ == StatusCode::ok; }
  [[nodiscard]] StatusCode code() const { return code_; }
  [[nodiscard]] const std::string& message() const& { return message_; }
  /// By value for a temporary, such as `result.status().message()`.
  [[nodiscard]] std::string message() && { return std::move(message_); }

 private:
  StatusCode code_ = StatusCode::ok;
  std::string message_;
};

/// A value, or the status with the reason why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : held_(std::move(value)) {}         // NOLINT: meant to be implicit
  Result(Status status) : held_(std::move(status)) {}  // NOLINT: meant to be implicit

  [[nodiscard]] bool ok() const { return std::holds_alternative<T>(held_); }
  explicit operator bool() const { return ok(); }

  /// Requires ok().
  [[nodiscard]] T& value() { return std::get<T>(held_); }
  [[nodiscard]] const T& value() const { return std::get<T>(held_); }
  T& operator*() { return value(); }
  const T& operator*() const { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  /// ok() or the reason.
  [[nodiscard]] Status status() const { return ok() ? Status() : std::get<Status>(held_); }

 private:
  std::variant<T, Status> held_;
};

}  // namespace lightwell
