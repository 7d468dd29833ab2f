// Replaces libusb_transport.cpp if libusb was not found.
#include "core/usb_transport.hpp"

namespace lightwell::core {

Result<std::vector<std::string>> probes_on_usb() {
  return Status(StatusCode::failed_precondition,
                "this SDK was built without libusb: install libusb-1.0-0-dev and configure it again");
}

Result<std::unique_ptr<UsbTransport>> make_libusb_transport() {
  return Status(
      StatusCode::failed_precondition,
      "this SDK was built without libusb: install libusb-1.0-0-dev and configure it again, or reach the probe "
      "by its network function at grpc://HOST:PORT");
}

}  // namespace lightwell::core
