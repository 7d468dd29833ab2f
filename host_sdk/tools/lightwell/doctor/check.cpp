#include "doctor/check.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <thread>
#include <utility>

#include <lightwell/text.hpp>

namespace lightwell::tool {

std::string_view to_string(Verdict verdict) {
  constexpr std::string_view kNames[] = {"ok", "warning", "fault", "not checked"};
  return kNames[static_cast<std::size_t>(verdict)];
}

Finding ok(std::string found) { return {Verdict::ok, std::move(found)}; }
Finding warning(std::string found, std::string remedy) {
  return {Verdict::warning, std::move(found), std::move(remedy)};
}
Finding fault(std::string found, std::string remedy) { return {Verdict::fault, std::move(found), std::move(remedy)}; }
Finding not_checked(std::string why, std::string remedy) {
  return {Verdict::not_checked, std::move(why), std::move(remedy)};
}

Outcome run_check(std::function<Finding()> check, Duration limit, const std::function<void()>& on_slow) {
  std::packaged_task<Finding()> task(std::move(check));
  std::future<Finding> finding = task.get_future();
  std::thread(std::move(task)).detach();
  const std::chrono::nanoseconds quiet(kQuietTime.ns), all(limit.ns);
  bool ended = finding.wait_for(std::min(quiet, all)) == std::future_status::ready;
  if (!ended && all > quiet) {
    on_slow();
    ended = finding.wait_for(all - quiet) == std::future_status::ready;
  }
  if (!ended)
    return {not_checked(formatted("did not end within %.0f s", limit.seconds()),
                        "try again; if it stays, the system's resolver or a file system does not respond"),
            Outcome::Thread::left_behind};
  try {
    return {finding.get()};
  } catch (const std::exception& error) {
    return {not_checked(error.what())};
  }
}

}  // namespace lightwell::tool
