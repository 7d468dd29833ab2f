// A program under test, run as a process of its own.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "support/temp_dir.hpp"
#include "support/wait.hpp"

namespace lightwell::test {

struct ChildOptions {
  /// Added to this process's own, NAME=value.
  std::vector<std::string> environment{};
  /// RLIMIT_FSIZE; 0: none.
  std::size_t largest_file_bytes = 0;
};

/// How a process ended: an exit code, or the signal that killed it.
struct Ending {
  int code = -1;
  int signal = 0;

  friend bool operator==(const Ending&, const Ending&) = default;
};
std::ostream& operator<<(std::ostream& out, const Ending& ending);

/// Starts on construction; killed and reaped by the destructor where it still runs.
class Child {
 public:
  explicit Child(const std::vector<std::string>& command, const ChildOptions& options = {});
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();

  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const;

  /// Nothing while it runs.
  [[nodiscard]] std::optional<Ending> ended();
  /// Waits; a process that goes on running is a failure, told with all that it has said.
  [[nodiscard]] Ending wait(std::chrono::milliseconds timeout = kTestTimeout);

  /// So far.
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;

  /// The number behind "Name:" in /proc/PID/status, such as "Threads"; 0 where it is gone.
  [[nodiscard]] long status_number(std::string_view name) const;

 private:
  TempDir folder_;  ///< Of both outputs: files never make a child wait for a reader.
  pid_t pid_ = -1;
  std::optional<Ending> ending_;
};

/// The same of any process.
[[nodiscard]] long proc_status_number(pid_t pid, std::string_view name);

/// How often `part` is in `text`.
[[nodiscard]] std::size_t occurrences(std::string_view text, std::string_view part);

}  // namespace lightwell::test
