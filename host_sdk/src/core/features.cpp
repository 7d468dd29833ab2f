#include "core/features.hpp"

namespace lightwell::core {
namespace {

#ifdef LIGHTWELL_HAVE_GRPC
constexpr Built kGrpc = Built::yes;
#else
constexpr Built kGrpc = Built::no;
#endif
#ifdef LIGHTWELL_HAVE_WEB
constexpr Built kWeb = Built::yes;
#else
constexpr Built kWeb = Built::no;
#endif
#ifdef LIGHTWELL_HAVE_MQTT
constexpr Built kMqtt = Built::yes;
#else
constexpr Built kMqtt = Built::no;
#endif
#ifdef LIGHTWELL_HAVE_USB
constexpr Built kUsb = Built::yes;
#else
constexpr Built kUsb = Built::no;
#endif
#ifdef LIGHTWELL_HAVE_MDNS
constexpr Built kMdns = Built::yes;
#else
constexpr Built kMdns = Built::no;
#endif

}  // namespace

std::array<Feature, 5> features() {
  return {{{"grpc:// and pairing", "libgrpc++-dev", kGrpc},
           {"ws://", "libwebsockets-dev", kWeb},
           {"mqtt://", "libmosquitto-dev", kMqtt},
           {"usb:", "libusb-1.0-0-dev", kUsb},
           {"discovery by mDNS", "libavahi-client-dev", kMdns}}};
}

}  // namespace lightwell::core
