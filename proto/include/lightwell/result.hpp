// Status and Result: error reporting of all Lightwell libraries. Nothing here throws.
#pragma once

#include <cstddef>
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
  constexpr std::string_view kNames[] = {
      "ok",          "invalid_argument",   "not_found", "data_loss", "failed_precondition",
      "unavailable", "resource_exhausted", "internal"};
  return code <= StatusCode::internal ? kNames[static_cast<std::size_t>(code)] : "unknown";
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
  /// The same error with "where: " before its message; ok stays ok.
  [[nodiscard]] Status in(const std::string& where) const {
    return ok() ? Status() : Status(code_, where + ": " + message_);
  }

 private:
  StatusCode code_ = StatusCode::ok;
  std::string message_;
};

[[nodiscard]] inline Status invalid_argument(std::string message) {
  return {StatusCode::invalid_argument, std::move(message)};
}

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

  /// Moves the value into `out`, if there is one; returns status().
  template <class Out>
  [[nodiscard]] Status assign_to(Out& out) && {
    if (ok()) out = std::move(value());
    return status();
  }

  /// ok() or the reason.
  [[nodiscard]] Status status() const { return ok() ? Status() : std::get<Status>(held_); }

 private:
  std::variant<T, Status> held_;
};

}  // namespace lightwell
