#include "support/machine.hpp"

#include <csignal>
#include <filesystem>
#include <unistd.h>

namespace lightwell::test {
namespace {

void run(const std::vector<std::string>& command) {
  Child child(command);
  EXPECT_EQ(child.wait(), (ExitStatus{0, 0})) << command[0] << ": " << child.err();
}

}  // namespace

Machine::Machine(const std::string& name) : name_(name) {
  folder_.write("bus.conf",
                "<busconfig><type>system</type><listen>" + bus_address() +
                    "</listen><auth>EXTERNAL</auth><policy context=\"default\"><allow send_destination=\"*\"/>"
                    "<allow receive_sender=\"*\"/><allow own=\"*\"/><allow user=\"*\"/></policy></busconfig>\n");
  folder_.write("avahi.conf",
                "[server]\nhost-name=" + name + "\nuse-ipv6=no\n[publish]\npublish-workstation=no\npublish-hinfo=no\n");
  // avahi-daemon keeps its process id in /run, so each machine has its own /run.
  namespaces_.emplace(std::vector<std::string>{LIGHTWELL_UNSHARE, "-m", "-n", "/bin/sh", "-c",
                                               "mount -t tmpfs none /run && mkdir /run/avahi-daemon && "
                                               "ip link set lo up && echo up && exec sleep infinity"});
  EXPECT_TRUE(becomes_true("the machine is up", [&] {
    return namespaces_->out() == "up\n" || namespaces_->exit_status();
  })) << namespaces_->err();
  start_bus();
}

std::vector<std::string> Machine::inside(std::vector<std::string> command) const {
  std::vector<std::string> out = {LIGHTWELL_NSENTER, "-t", std::to_string(pid()), "-m", "-n"};
  out.insert(out.end(), command.begin(), command.end());
  return out;
}

void Machine::start_bus() {
  bus_.emplace(std::vector<std::string>{LIGHTWELL_DBUS_DAEMON, "--config-file=" + folder_.path("bus.conf"), "--nofork",
                                        "--nopidfile"});
  EXPECT_TRUE(becomes_true("the bus is there", [&] { return std::filesystem::exists(folder_.path("bus")); }))
      << bus_->err();
}

void Machine::stop_bus() {
  bus_->signal(SIGTERM);
  (void)bus_->wait();
  std::filesystem::remove(folder_.path("bus"));
}

void Machine::start_avahi() {
  avahi_.emplace(
      std::vector<std::string>{LIGHTWELL_NSENTER, "-t", std::to_string(pid()), "-m", "-n", LIGHTWELL_AVAHI_DAEMON,
                               "--no-drop-root", "--no-chroot", "--no-rlimits", "-f", folder_.path("avahi.conf")},
      ChildOptions{.environment = {environment()}});
  EXPECT_TRUE(becomes_true("avahi-daemon is there", [&] {
    return avahi_->exit_status() || avahi_->err().find("Server startup complete") != std::string::npos;
  })) << avahi_->err();
}

void Machine::stop_avahi() {
  avahi_->signal(SIGTERM);
  (void)avahi_->wait();
}

void connect(const Machine& one, const Machine& other) {
  static int cables = 0;
  const std::string id = std::to_string(::getpid()) + "-" + std::to_string(++cables);
  const std::string ends[] = {"a" + id, "b" + id};
  run({LIGHTWELL_IP, "link", "add", ends[0], "type", "veth", "peer", "name", ends[1]});
  int address = 0;
  for (const Machine* machine : {&one, &other}) {
    const std::string& end = ends[address];
    const std::string pid = std::to_string(machine->pid());
    run({LIGHTWELL_IP, "link", "set", end, "netns", pid});
    run({LIGHTWELL_NSENTER, "-t", pid, "-n", LIGHTWELL_IP, "addr", "add",
         "10.77.0." + std::to_string(++address) + "/24", "dev", end});
    run({LIGHTWELL_NSENTER, "-t", pid, "-n", LIGHTWELL_IP, "link", "set", end, "up"});
  }
}

}  // namespace lightwell::test
