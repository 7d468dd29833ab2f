// Names and addresses of hosts, by the system's resolver.
#pragma once

#include <string>
#include <vector>

namespace lightwell {

enum class HostForm {
  numeric,  ///< An IPv4 or IPv6 address: nothing is asked.
  any,      ///< A name, too. The resolver may take many seconds and cannot be interrupted.
};

/// Numeric addresses of `host`, in the resolver's order; empty if there is none.
[[nodiscard]] std::vector<std::string> numeric_addresses(const std::string& host, HostForm form);

/// This machine's name; "client" if it has none.
[[nodiscard]] std::string host_name();

/// The name of a network interface of this machine, as link-local addresses have it after "%"; empty if there is none.
[[nodiscard]] std::string interface_name(unsigned index);

}  // namespace lightwell
