#include "e2e/secure_daemon.hpp"

#include <filesystem>
#include <utility>

namespace lightwell::test {
namespace {

std::vector<std::string> pairing_command(std::vector<std::string> options, int link_port) {
  options.insert(options.end(), {"--pair", "--pair-listen", "127.0.0.1:0"});
  return daemon_command({.listen = "127.0.0.1:" + std::to_string(link_port), .more = std::move(options)});
}

/// The part of `text` between two delimiters.
std::string between(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t begin = text.find(from);
  if (begin == std::string::npos) return {};
  return text.substr(begin + from.size(), text.find(to, begin + from.size()) - begin - from.size());
}

}  // namespace

int port_of(const std::string& address) { return std::stoi(address.substr(address.rfind(':') + 1)); }

PairingMode::PairingMode(std::vector<std::string> options, int link_port)
    : child_(pairing_command(std::move(options), link_port)) {
  EXPECT_TRUE(becomes_true("lightwelld --pair shows its code", [&] {
    return child_.exit_status() || child_.out().find('\n') != std::string::npos;
  })) << child_.err();
  uri_ = between(child_.out(), "pairing on ", " for ");
  code_ = between(child_.out(), "code ", "\n");
  EXPECT_EQ(code_.size(), 6U) << child_.out() << child_.err();
}

std::string SecureDaemonTest::pair(PairingMode& mode, int through_port) {
  const std::string uri = through_port == 0 ? mode.uri() : "grpcs://127.0.0.1:" + std::to_string(through_port);
  Child tool(tool_command({"pair", uri, "--code", mode.code(), "--name", "desk"}), environment());
  EXPECT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();
  EXPECT_EQ(mode.process().wait(), (ExitStatus{0, 0})) << mode.process().err();
  return between(tool.out(), "credentials  ", "\n");
}

}  // namespace lightwell::test
