// Machines on a network of the test's own: each has its interfaces, its system bus and its avahi-daemon. Needs root and
// namespaces.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "support/child.hpp"

namespace lightwell::test {

/// Processes run on this very machine; what makes it another one to them is the bus that `environment()` names.
class Machine {
 public:
  explicit Machine(const std::string& name);

  void start_bus();
  void stop_bus();
  void start_avahi();
  void stop_avahi();

  /// A command that runs on this machine's network and files.
  [[nodiscard]] std::vector<std::string> inside(std::vector<std::string> command) const;

  /// For ChildOptions; "DBUS_SYSTEM_BUS_ADDRESS=...".
  [[nodiscard]] std::string environment() const { return "DBUS_SYSTEM_BUS_ADDRESS=" + bus_address(); }
  [[nodiscard]] std::string bus_address() const { return "unix:path=" + folder_.path("bus"); }
  [[nodiscard]] pid_t pid() const { return namespaces_->pid(); }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  const std::string name_;
  TempDir folder_;
  std::optional<Child> namespaces_;  ///< Sleeps; what it stands in is the machine.
  std::optional<Child> bus_, avahi_;
};

/// An Ethernet cable. Gone with the machines.
void connect(const Machine& one, const Machine& other);

}  // namespace lightwell::test
