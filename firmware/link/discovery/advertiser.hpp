// Announces the probe by DNS-SD (RFC 6763) through this machine's avahi-daemon. The only use of Avahi in the firmware.
#pragma once

#include <memory>
#include <string>

#include <lightwell/advertisement.hpp>

namespace lightwell {

/// Has its own thread. Waits for a daemon that is absent or restarts. If another probe has the same name, changes the
/// instance name of the record ("attic" becomes "attic #2"), not the probe's own name.
class Advertiser {
 public:
  explicit Advertiser(const Advertisement& advertisement);
  ~Advertiser();
  Advertiser(const Advertiser&) = delete;
  Advertiser& operator=(const Advertiser&) = delete;

  /// The instance name that is announced; empty while there is none. Any thread.
  [[nodiscard]] std::string announced_as() const;
  /// Why the probe is not announced, for people; empty while it is. Any thread.
  [[nodiscard]] std::string error_message() const;

 private:
  class Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace lightwell
