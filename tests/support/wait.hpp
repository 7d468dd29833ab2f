// Bounded waits for conditions that other threads or processes fulfil.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace lightwell::test {

/// Time limit for events on a busy machine; no test expects to wait that long. Longer with a sanitizer, which slows
/// everything down.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr std::chrono::milliseconds kTestTimeout{60'000};
#else
inline constexpr std::chrono::milliseconds kTestTimeout{30'000};
#endif

/// Tests `condition` every 5 ms until it holds or `timeout` has passed.
///   EXPECT_TRUE(becomes_true("the client is gone", [&] { ... }));
[[nodiscard]] inline ::testing::AssertionResult becomes_true(const std::string& what,
                                                             const std::function<bool()>& condition,
                                                             std::chrono::milliseconds timeout = kTestTimeout) {
  const auto end = std::chrono::steady_clock::now() + timeout;
  do {
    if (condition()) return ::testing::AssertionSuccess();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  } while (std::chrono::steady_clock::now() < end);
  if (condition()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "after " << timeout.count() << " ms this does not hold: " << what;
}

}  // namespace lightwell::test
