// Checks of `lightwell doctor`: a name, a verdict, what was found, and the remedy.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <lightwell/time.hpp>

namespace lightwell::tool {

enum class Verdict : std::uint8_t {
  ok,
  warning,      ///< Works, or may work, but something is not as it should be.
  fault,        ///< Does not work.
  not_checked,  ///< It could not be checked, or does not apply here; `found` says why.
};

/// "ok", "warning", "fault", "not checked".
[[nodiscard]] std::string_view to_string(Verdict verdict);

struct Finding {
  Verdict verdict = Verdict::ok;
  std::string found;     ///< What is the case. May hold text of the network: escape it before printing.
  std::string remedy{};  ///< What to do; empty if there is nothing to do.

  friend bool operator==(const Finding&, const Finding&) = default;
};

[[nodiscard]] Finding ok(std::string found);
[[nodiscard]] Finding warning(std::string found, std::string remedy);
[[nodiscard]] Finding fault(std::string found, std::string remedy);
[[nodiscard]] Finding not_checked(std::string why, std::string remedy = {});

/// After this time a check reports that it still runs.
inline constexpr Duration kQuietTime{2'000'000'000};

/// Runs `check` on a thread of its own, calls `on_slow` once after kQuietTime, and gives it up after `limit`: then the
/// finding is not_checked, and the thread is left behind, because neither the system's resolver nor a file of a
/// network can be interrupted. What `check` refers to must therefore be owned by it.
struct Outcome {
  Finding finding;
  enum class Thread : std::uint8_t { ended, left_behind } thread = Thread::ended;
};
[[nodiscard]] Outcome run_check(std::function<Finding()> check, Duration limit, const std::function<void()>& on_slow);

}  // namespace lightwell::tool
