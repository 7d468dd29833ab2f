#include "e2e/daemon.hpp"

#include <csignal>

namespace lightwell::test {
namespace {

constexpr std::string_view kListenerTimeout = "lightwelld: listening on ";

ProbeOptions options_with(std::function<void(const Arrival&)> on_descriptor) {
  ProbeOptions o;
  o.max_age = kAnyAge;
  o.connect_timeout = Duration{kTestTimeout.count() * 1'000'000};
  o.on_descriptor = std::move(on_descriptor);
  return o;
}

}  // namespace

std::vector<std::string> daemon_command(const DaemonOptions& options) {
  std::vector<std::string> command = {
      LIGHTWELLD, "--listen", options.listen, "--size", "160x120", "--frame-rate", std::to_string(options.frame_rate)};
  if (!options.camera.empty()) command.insert(command.end(), {"--camera", options.camera});
  for (const double e : options.exposure_s) command.insert(command.end(), {"--exposure-s", std::to_string(e)});
  command.insert(command.end(), options.more.begin(), options.more.end());
  return command;
}

std::vector<std::string> tool_command(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), LIGHTWELL_CLI);
  return arguments;
}

const std::string& Daemon::uri() {
  if (!uri_.empty()) return uri_;
  std::string out;
  EXPECT_TRUE(becomes_true("lightwelld listens", [&] {
    out = child_.out();
    return child_.exit_status() || out.find('\n') != std::string::npos;
  })) << child_.err();
  const std::size_t at = out.find(kListenerTimeout);
  if (at == std::string::npos) {
    ADD_FAILURE() << "lightwelld did not start:\n" << child_.err();
    return uri_;
  }
  const std::size_t begin = at + kListenerTimeout.size();
  return uri_ = out.substr(begin, out.find('\n', begin) - begin);
}

ExitStatus Daemon::stop() {
  child_.signal(SIGTERM);
  return child_.wait();
}

Observer::Observer(const std::string& uri)
    : probe_(Probe::connect(uri, options_with([this](const Arrival& arrival) {
                              const std::lock_guard lock(mutex_);
                              bytes_[arrival.descriptor.sequence].assign(arrival.bytes.begin(), arrival.bytes.end());
                              descriptors_.push_back(arrival.descriptor);
                            }))) {
  EXPECT_TRUE(probe_.ok()) << probe_.status().message();
}

std::size_t Observer::count() const {
  const std::lock_guard lock(mutex_);
  return descriptors_.size();
}

std::map<std::uint64_t, std::vector<std::byte>> Observer::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::vector<Descriptor> Observer::descriptors() const {
  const std::lock_guard lock(mutex_);
  return descriptors_;
}

std::vector<std::uint64_t> Observer::missing() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint64_t> out;
  if (bytes_.empty()) return out;
  for (std::uint64_t s = bytes_.begin()->first; s < bytes_.rbegin()->first; ++s)
    if (!bytes_.contains(s)) out.push_back(s);
  return out;
}

::testing::AssertionResult Observer::gets(std::size_t more) const {
  const std::size_t enough = count() + more;
  return becomes_true(std::to_string(more) + " more descriptors have arrived", [&] { return count() >= enough; });
}

}  // namespace lightwell::test
