// The errors of links, and of what belongs to them, that this SDK was built without.
#include <lightwell/pair.hpp>

#include "core/discovery_backends.hpp"
#include "core/source.hpp"
#include "core/usb_transport.hpp"

namespace lightwell {

#ifndef LIGHTWELL_HAVE_GRPC
namespace {

constexpr const char* kBuiltWithoutGrpc =
    "this SDK was built without gRPC: install libgrpc++-dev and configure it again with LIGHTWELL_WITH_GRPC=ON";

}  // namespace

Result<std::unique_ptr<core::Source>> core::make_source(const GrpcAddress&, ProbeOptions, DescriptorReceiver&) {
  return Status(StatusCode::failed_precondition,
                std::string(kBuiltWithoutGrpc) +
                    ", or reach the probe at ws://HOST:7443 (`lightwelld --web`), usb: or mqtt://BROKER/TOPIC");
}

Result<PairedProbe> pair_with_probe(std::string_view uri, std::string_view, const PairOptions&) {
  return Status(StatusCode::failed_precondition, std::string(uri) + ": " + kBuiltWithoutGrpc);
}
#endif

#ifndef LIGHTWELL_HAVE_WEB
Result<std::unique_ptr<core::Source>> core::make_source(const WebAddress&, ProbeOptions, DescriptorReceiver&) {
  return Status(StatusCode::failed_precondition,
                "this SDK was built without WebSocket; install libwebsockets-dev and build it again");
}
#endif

#ifndef LIGHTWELL_HAVE_MQTT
Result<std::unique_ptr<core::Source>> core::make_source(const MqttAddress&, const ProbeOptions&, DescriptorReceiver&) {
  return Status(StatusCode::failed_precondition,
                "this SDK was built without MQTT; install libmosquitto-dev and build it again");
}

void core::discover_at_broker(const MqttAddress&, const MqttCredentials&, Duration, DiscoveryResults& results) {
  results.problem("MQTT: this SDK was built without it; install libmosquitto-dev and build it again");
}
#endif

#ifndef LIGHTWELL_HAVE_USB
Result<std::vector<std::string>> core::probes_on_usb() {
  return Status(StatusCode::failed_precondition,
                "this SDK was built without libusb: install libusb-1.0-0-dev and configure it again");
}

Result<std::unique_ptr<core::UsbTransport>> core::make_libusb_transport() {
  return Status(
      StatusCode::failed_precondition,
      core::probes_on_usb().status().message() + ", or reach the probe by its network function at grpc://HOST:PORT");
}
#endif

}  // namespace lightwell
