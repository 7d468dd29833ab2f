#include "app/network.hpp"

#include <lightwell/advertisement.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/time.hpp>

#include "app/log.hpp"
#include "link/grpc/grpc_link.hpp"
#include "link/usb_gadget/usb_gadget_link.hpp"
#ifdef LIGHTWELL_HAVE_LINK_MQTT
#include "link/mqtt/mqtt_link.hpp"
#endif
#ifdef LIGHTWELL_HAVE_DISCOVERY
#include "link/discovery/advertiser.hpp"
#endif

namespace lightwell {
#ifndef LIGHTWELL_HAVE_DISCOVERY
class Advertiser {};
#endif

Status add_links(const Config& config, Commands& commands, Publisher& publisher) {
  publisher.add(make_grpc_link(config.grpc, config.probe_name, commands));
  if (config.usb_gadget) publisher.add(make_usb_gadget_link(*config.usb_gadget, commands));
  if (config.mqtt) {
#ifdef LIGHTWELL_HAVE_LINK_MQTT
    publisher.add(make_mqtt_link(*config.mqtt, config.probe_name, commands));
#else
    return {StatusCode::failed_precondition,
            "mqtt: this lightwelld was built without MQTT; install libmosquitto-dev and build it again, or leave "
            "`mqtt` out"};
#endif
  }
#ifndef LIGHTWELL_HAVE_DISCOVERY
  if (config.mdns == Mdns::on)
    return {
        StatusCode::failed_precondition,
        "discovery: this lightwelld was built without Avahi; install libavahi-client-dev and build it again, or leave "
        "`discovery` out"};
#endif
  return {};
}

NetworkMonitor::NetworkMonitor(const Config& config, [[maybe_unused]] const StatusSnapshot& status,
                               const Publisher& publisher)
    : publisher_(publisher) {
  if (config.mdns != Mdns::on) return;
#ifdef LIGHTWELL_HAVE_DISCOVERY
  Advertisement a{status.probe_name, status.probe_id, status.calibration_id, status.version, kWireVersion, {}};
  for (const auto& link : publisher.links())
    if (AdvertisedLink shown = advertised_link(link->address()); !shown.uri.empty())
      a.links.push_back(std::move(shown));
  advertiser_ = std::make_unique<Advertiser>(a);
  // Any text but "", so that the announced name is logged.
  last_logged_["discovery"] = "nothing logged yet";
#endif
}

NetworkMonitor::~NetworkMonitor() = default;

void NetworkMonitor::log_transition(const std::string& what, const std::string& error_message,
                                    const std::string& good) {
  std::string& last_logged = last_logged_[what];
  if (last_logged == error_message) return;
  last_logged = error_message;
  error_message.empty() ? log_info(what + ": " + good) : log_error(what + ": " + error_message + "; it is tried again");
}

void NetworkMonitor::poll() {
  for (const auto& link : publisher_.links()) log_transition(link->address(), link->error_message(), "connected");
#ifdef LIGHTWELL_HAVE_DISCOVERY
  if (advertiser_)
    log_transition("discovery", advertiser_->error_message(), "announced as '" + advertiser_->announced_as() + "'");
#endif
  // At most once a minute, so that a flood of invalid messages does not fill the log.
  constexpr std::int64_t kMinute = 60'000'000'000;
  const std::uint64_t refused = publisher_.counters().messages_refused;
  const std::int64_t now = monotonic_now_ns();
  if (refused == logged_refused_ || (logged_refused_ns_ != 0 && now - logged_refused_ns_ < kMinute)) return;
  log_error(std::to_string(refused) +
            " messages from outside have been refused: malformed, not for this probe, or too many");
  logged_refused_ = refused;
  logged_refused_ns_ = now;
}

}  // namespace lightwell
