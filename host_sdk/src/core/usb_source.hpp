// Connection to a probe by USB, with any UsbTransport.
#pragma once

#include <memory>

#include "core/source.hpp"
#include "core/usb_transport.hpp"

namespace lightwell::core {

/// Starts to connect; DescriptorReceiver::describe() reports success. The receiver must outlive the source.
[[nodiscard]] std::unique_ptr<Source> make_usb_source(std::unique_ptr<UsbTransport> transport,
                                                      const UsbAddress& address, const ProbeOptions& options,
                                                      DescriptorReceiver& receiver);

}  // namespace lightwell::core
