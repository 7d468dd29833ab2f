// Announces the probe by DNS-SD (RFC 6763) through this machine's avahi-daemon. The only use of Avahi in the firmware.
#pragma once

#include <memory>
#include <string>

#include <lightwell/advertisement.hpp>

namespace lightwell {

/// Has its own thread, which ends with the object. Waits for a daemon that is absent or restarts. If another probe has
/// the same name, changes the instance name of the record ("attic" becomes "attic #2"), not the probe's own name.
class Advertiser {
 public:
  virtual ~Advertiser() = default;

  /// The instance name that is announced; empty while there is none. Any thread.
  [[nodiscard]] virtual std::string announced_as() const = 0;
  /// Why the probe is not announced, for people; empty while it is. Any thread.
  [[nodiscard]] virtual std::string error_message() const = 0;
};

[[nodiscard]] std::unique_ptr<Advertiser> make_advertiser(const Advertisement& advertisement);

}  // namespace lightwell
