// The link by USB cable, over any transport.
#pragma once

#include <memory>

#include "core/source.hpp"
#include "core/usb_transport.hpp"

namespace lightwell::core {

/// Begins to connect; DescriptorReceiver::describe() tells of success. The intake outlives the source.
[[nodiscard]] std::unique_ptr<Source> make_usb_source(std::unique_ptr<UsbTransport> transport,
                                                      const UsbAddress& address, const ProbeOptions& options,
                                                      DescriptorReceiver& receiver);

}  // namespace lightwell::core
