#include "support/child.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <ostream>
#include <thread>
#include <unistd.h>

#include <sys/resource.h>
#include <sys/wait.h>

#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> out;
  for (std::string& s : strings) out.push_back(s.data());
  out.push_back(nullptr);
  return out;
}

std::vector<std::string> merged_environment(const std::vector<std::string>& added) {
  std::vector<std::string> all;
  for (char** at = environ; *at != nullptr; ++at) {
    const std::string_view entry = *at;
    const std::string_view name = entry.substr(0, entry.find('=') + 1);
    bool replaced = false;
    for (const std::string& a : added) replaced = replaced || a.starts_with(name);
    if (!replaced) all.emplace_back(entry);
  }
  all.insert(all.end(), added.begin(), added.end());
  return all;
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const ExitStatus& status) {
  if (status.signal != 0) return out << "killed by signal " << status.signal;
  return out << "exit code " << status.code;
}

Child::Child(const std::vector<std::string>& command, const ChildOptions& options) {
  // All memory is allocated before fork(), because another thread of this process may hold the heap's lock.
  std::vector<std::string> arguments = command;
  std::vector<std::string> environment = merged_environment(options.environment);
  const std::vector<char*> argv = pointers(arguments), envp = pointers(environment);
  const std::string out = folder_.path("out"), err = folder_.path("err");
  pid_ = ::fork();
  if (pid_ != 0) {
    if (pid_ < 0) ADD_FAILURE() << "fork: " << std::strerror(errno);
    return;
  }
  const int flags = O_CREAT | O_WRONLY | O_APPEND;
  ::dup2(::open("/dev/null", O_RDONLY), 0);
  ::dup2(::open(out.c_str(), flags, 0600), 1);
  ::dup2(::open(err.c_str(), flags, 0600), 2);
  for (int fd = 3; fd < 1024; ++fd) ::close(fd);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  if (options.largest_file_bytes > 0) {
    const rlimit limit{options.largest_file_bytes, options.largest_file_bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ::execve(argv[0], argv.data(), envp.data());
  ::_exit(127);
}

Child::~Child() {
  if (pid_ < 0 || exit_status()) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void Child::signal(int number) const {
  if (pid_ > 0 && !exit_status_) ::kill(pid_, number);
}

std::optional<ExitStatus> Child::exit_status() {
  if (exit_status_ || pid_ < 0) return exit_status_;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  if (WIFEXITED(status)) exit_status_ = ExitStatus{WEXITSTATUS(status), 0};
  if (WIFSIGNALED(status)) exit_status_ = ExitStatus{-1, WTERMSIG(status)};
  return exit_status_;
}

ExitStatus Child::wait(std::chrono::milliseconds timeout) {
  EXPECT_TRUE(becomes_true(
      "the process ends", [this] { return exit_status().has_value(); }, timeout))
      << "its output:\n"
      << out() << err();
  return exit_status_.value_or(ExitStatus{});
}

std::string Child::out() const { return read_file(folder_.path("out")); }
std::string Child::err() const { return read_file(folder_.path("err")); }

long Child::status_number(std::string_view name) const { return proc_status_number(pid_, name); }

long proc_status_number(pid_t pid, std::string_view name) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(std::string(name) + ":")) return std::stol(line.substr(name.size() + 1));
  return 0;
}

std::size_t occurrences(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

}  // namespace lightwell::test
