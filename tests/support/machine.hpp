// Simulated machines on a private network, by Linux namespaces: each has its network interfaces, its D-Bus system bus
// and its avahi-daemon. Needs root.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "support/child.hpp"

namespace lightwell::test {

/// Programs under test run outside of the namespaces; environment() connects them to the machine's bus and so to its
/// avahi-daemon. inside() runs a command in the namespaces.
class Machine {
 public:
  explicit Machine(const std::string& name);

  void start_bus();
  void stop_bus();
  void start_avahi();
  void stop_avahi();

  /// `command`, extended so that it runs in this machine's network and mount namespaces.
  [[nodiscard]] std::vector<std::string> inside(std::vector<std::string> command) const;

  /// For ChildOptions; "DBUS_SYSTEM_BUS_ADDRESS=...".
  [[nodiscard]] std::string environment() const { return "DBUS_SYSTEM_BUS_ADDRESS=" + bus_address(); }
  [[nodiscard]] std::string bus_address() const { return "unix:path=" + folder_.path("bus"); }
  [[nodiscard]] pid_t pid() const { return namespaces_->pid(); }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  const std::string name_;
  TempDir folder_;
  std::optional<Child> namespaces_;  ///< A sleeping process that holds the namespaces.
  std::optional<Child> bus_, avahi_;
};

/// Connects two machines by a virtual Ethernet cable, which is removed with them.
void connect(const Machine& one, const Machine& other);

}  // namespace lightwell::test
