// USB: the device files of probes, and the udev rule.
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <unistd.h>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>
#include <lightwell/usb_ids.hpp>

#include "core/features.hpp"
#include "doctor/machine_checks.hpp"

namespace lightwell::tool {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInstallRule =
    "install the SDK's rule: `sudo cp PREFIX/share/lightwell/udev/70-lightwell.rules /etc/udev/rules.d/`, with the "
    "SDK's PREFIX, such as /usr, then `sudo udevadm control --reload`, and plug the probe in again";

std::string usb_id_text(std::uint16_t id) { return formatted("%04x", static_cast<unsigned>(id)); }

std::string first_line_of(const fs::path& path) {
  std::string line;
  std::ifstream file(path);
  std::getline(file, line);
  return line;
}

/// The device files of all probes that are plugged in.
std::vector<std::string> probe_nodes(const UsbPaths& paths) {
  std::vector<std::string> nodes;
  std::error_code error;
  for (fs::directory_iterator it(paths.devices, error), end; !error && it != end; it.increment(error)) {
    if (first_line_of(it->path() / "idVendor") != usb_id_text(kUsbVendor) ||
        first_line_of(it->path() / "idProduct") != usb_id_text(kUsbProduct) ||
        first_line_of(it->path() / "manufacturer") != kUsbManufacturer)
      continue;
    const auto bus = parse_number<unsigned>(first_line_of(it->path() / "busnum"));
    const auto device = parse_number<unsigned>(first_line_of(it->path() / "devnum"));
    if (bus && device) nodes.push_back(formatted("%s/%03u/%03u", paths.nodes.c_str(), *bus, *device));
  }
  return nodes;
}

/// 0, or the errno of opening the device file.
int opening_error(const std::string& node) {
  const FileDescriptor file(open(node.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  return file ? 0 : errno;
}

/// Whether the file has both numbers of a probe.
bool is_rule_for_probe(const fs::path& file) {
  std::error_code error;
  constexpr std::uintmax_t kMaxRuleBytes = 1 << 20;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size > kMaxRuleBytes || file.extension() != ".rules") return false;
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str().find('"' + usb_id_text(kUsbVendor) + '"') != std::string::npos &&
         text.str().find('"' + usb_id_text(kUsbProduct) + '"') != std::string::npos;
}

}  // namespace

Finding check_usb_devices(const UsbPaths& paths) {
  for (const core::Feature& f : core::features())
    if (f.name == "usb:" && f.built == core::Built::no)
      return not_checked("this SDK was built without USB", "install libusb-1.0-0-dev and build the SDK again");
  std::error_code error;
  if (!fs::is_directory(paths.devices, error))
    return not_checked(paths.devices + " does not exist: this system has no USB, or is a container without it");
  const std::vector<std::string> nodes = probe_nodes(paths);
  if (nodes.empty())
    return not_checked("no probe is plugged in",
                       "to use one by USB: does the cable carry data, and does the probe's configuration have "
                       "usb_gadget {}?");
  for (const std::string& node : nodes) {
    const int opening = opening_error(node);
    if (opening == 0) continue;
    const std::string found = "a probe is plugged in, and " + node + ": " + std::strerror(opening);
    return opening == EACCES || opening == EPERM
               ? fault(found, std::string("this user may not open it: ") + kInstallRule)
               : fault(found, "in a container, pass the device on (docker: --device " + paths.nodes + ")");
  }
  return ok("this user may open " + joined(nodes));
}

Finding check_usb_rule(const UsbPaths& paths) {
  for (const std::string& folder : paths.rules) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
      if (is_rule_for_probe(it->path())) return ok(text_of(it->path()));
  }
  if (geteuid() == 0) return not_checked("no rule is installed; root needs none");
  std::error_code error;
  if (!fs::is_directory(paths.udev, error)) return not_checked("udev does not run on this system");
  return warning("no rule for probes is installed", std::string("only for probes by USB: ") + kInstallRule);
}

}  // namespace lightwell::tool
