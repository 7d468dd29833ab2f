// Tells the network that there is a probe: DNS-SD through this machine's avahi-daemon. All of the firmware that sees
// Avahi.
#pragma once

#include <memory>
#include <string>

#include <lightwell/advertisement.hpp>

namespace lightwell {

/// One thread of its own. A daemon that is absent, goes or restarts is waited for; a name that another probe has is
/// changed
/// ("attic" becomes "attic #2"), in the record's instance name, not in the probe's own.
class Advertiser {
 public:
  explicit Advertiser(const Advertisement& advertisement);
  ~Advertiser();
  Advertiser(const Advertiser&) = delete;
  Advertiser& operator=(const Advertiser&) = delete;

  /// The instance name under which others see it; empty while they do not. Any thread.
  [[nodiscard]] std::string announced_as() const;
  /// Why nobody sees it, for a person; empty where they do. Any thread.
  [[nodiscard]] std::string error_message() const;

 private:
  class Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace lightwell
