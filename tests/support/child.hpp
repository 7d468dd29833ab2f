// Runs a program under test as a child process.
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
  /// NAME=value, added to this process's environment.
  std::vector<std::string> environment{};
  /// RLIMIT_FSIZE; 0: no limit.
  std::size_t largest_file_bytes = 0;
};

/// How a process ended: an exit code, or the signal that killed it.
struct ExitStatus {
  int code = -1;
  int signal = 0;

  friend bool operator==(const ExitStatus&, const ExitStatus&) = default;
};
std::ostream& operator<<(std::ostream& out, const ExitStatus& status);

/// Starts on construction. The destructor kills and reaps the process if it still runs.
class Child {
 public:
  explicit Child(const std::vector<std::string>& command, const ChildOptions& options = {});
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();

  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const;

  /// std::nullopt while the process runs.
  [[nodiscard]] std::optional<ExitStatus> exit_status();
  /// Waits for the end of the process. A process that still runs after `timeout` is a test failure, with its output.
  [[nodiscard]] ExitStatus wait(std::chrono::milliseconds timeout = kTestTimeout);

  /// Output on stdout and stderr so far.
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;

  /// The number after "name:" in /proc/PID/status, such as "Threads"; 0 if the process is gone.
  [[nodiscard]] long status_number(std::string_view name) const;

 private:
  TempDir folder_;  ///< Holds both outputs as files, which never block the child as pipes would.
  pid_t pid_ = -1;
  std::optional<ExitStatus> exit_status_;
};

/// As Child::status_number(), for any process.
[[nodiscard]] long proc_status_number(pid_t pid, std::string_view name);

/// Number of non-overlapping occurrences of `part` in `text`.
[[nodiscard]] std::size_t occurrences(std::string_view text, std::string_view part);

}  // namespace lightwell::test
