// Waiting for what other threads and processes do: bounded, and it says for what.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace lightwell::test {

/// A bound for a machine that is busy or hung; no test expects anything to take so long. More under
/// a sanitizer, which makes all of it slow.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr std::chrono::milliseconds kTestTimeout{60'000};
#else
inline constexpr std::chrono::milliseconds kTestTimeout{30'000};
#endif

/// Looks every few milliseconds. EXPECT_TRUE(becomes_true("the client is gone", [&] { ... }));
[[nodiscard]] inline ::testing::AssertionResult becomes_true(const std::string& what,
                                                           const std::function<bool()>& condition,
                                                           std::chrono::milliseconds timeout = kTestTimeout) {
  const auto end = std::chrono::steady_clock::now() + timeout;
  do {
    if (condition()) return ::testing::AssertionSuccess();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  } while (std::chrono::steady_clock::now() < end);
  if (condition()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "waited " << timeout.count() << " ms in vain until " << what;
}

}  // namespace lightwell::test
