#include "link/usb_gadget/ffs_descriptors.hpp"

#include <cstdint>
#include <span>
#include <string_view>

#include <linux/usb/functionfs.h>

#include <lightwell/usb_ids.hpp>

namespace lightwell {
namespace {

/// Serialises little-endian numbers.
class Bytes {
 public:
  Bytes& u8(unsigned v) { return put(v, 1); }
  Bytes& u16(unsigned v) { return put(v, 2); }
  Bytes& u32(std::size_t v) { return put(v, 4); }
  /// With a terminating zero.
  Bytes& text(std::string_view v) {
    for (const char c : v) u8(static_cast<unsigned char>(c));
    return u8(0);
  }
  Bytes& zeros(int count) {
    for (; count > 0; --count) u8(0);
    return *this;
  }
  Bytes& append(const std::vector<std::byte>& v) {
    all_.insert(all_.end(), v.begin(), v.end());
    return *this;
  }
  [[nodiscard]] const std::vector<std::byte>& all() const { return all_; }
  [[nodiscard]] std::size_t size() const { return all_.size(); }

 private:
  Bytes& put(std::size_t v, int bytes) {
    for (int i = 0; i < bytes; ++i) all_.push_back(static_cast<std::byte>(v >> (8 * i) & 255U));
    return *this;
  }
  std::vector<std::byte> all_;
};

constexpr unsigned kIn = USB_DIR_IN | 1U, kOut = USB_DIR_OUT | 2U;

void interface_descriptor(Bytes& out) {
  out.u8(USB_DT_INTERFACE_SIZE).u8(USB_DT_INTERFACE).u8(0).u8(0).u8(2);
  out.u8(kUsbInterfaceClass).u8(kUsbInterfaceSubclass).u8(kUsbInterfaceProtocol).u8(1);
}

void endpoint_descriptor(Bytes& out, unsigned address, unsigned packet_bytes) {
  out.u8(USB_DT_ENDPOINT_SIZE).u8(USB_DT_ENDPOINT).u8(address).u8(USB_ENDPOINT_XFER_BULK).u16(packet_bytes).u8(0);
}

/// The companion descriptor of super speed: no bursts, no streams, because light descriptors are small.
void companion_descriptor(Bytes& out) { out.u8(USB_DT_SS_EP_COMP_SIZE).u8(USB_DT_SS_ENDPOINT_COMP).zeros(4); }

constexpr std::size_t kOsHeaderBytes = sizeof(usb_os_desc_header);

/// "Extended compat ID", index 4: selects the driver that Windows loads.
void compatible_id(Bytes& out) {
  Bytes function;
  function.u8(0).u8(1);  // the first interface; reserved, 1
  function.text("WINUSB").zeros(1).zeros(8).zeros(6);
  out.u8(0).u32(kOsHeaderBytes + function.size()).u16(1).u16(4).u8(1).u8(0).append(function.all());
}

/// "Extended properties", index 5. The kernel turns name and value into UTF-16.
void interface_guid(Bytes& out) {
  constexpr std::string_view kName = "DeviceInterfaceGUID";
  const std::string_view value = kUsbInterfaceGuid;
  constexpr unsigned kText = 1;  // REG_SZ
  Bytes property;
  property.u32(14 + kName.size() + 1 + value.size() + 1).u32(kText);
  property.u16(static_cast<unsigned>(kName.size() + 1)).text(kName).u32(value.size() + 1).text(value);
  out.u8(0).u32(kOsHeaderBytes + property.size()).u16(1).u16(5).u16(1).append(property.all());
}

}  // namespace

std::vector<std::byte> ffs_descriptors() {
  Bytes body;
  body.u32(3).u32(3).u32(5).u32(2);  // Number of descriptors for full, high and super speed, and of Microsoft's.
  for (const unsigned packet_bytes : {64U, 512U}) {
    interface_descriptor(body);
    endpoint_descriptor(body, kIn, packet_bytes);
    endpoint_descriptor(body, kOut, packet_bytes);
  }
  interface_descriptor(body);
  for (const unsigned address : {kIn, kOut}) {
    endpoint_descriptor(body, address, 1024);
    companion_descriptor(body);
  }
  compatible_id(body);
  interface_guid(body);

  Bytes out;
  constexpr unsigned kFlags =
      FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC | FUNCTIONFS_HAS_MS_OS_DESC;
  out.u32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2).u32(12 + body.size()).u32(kFlags).append(body.all());
  return out.all();
}

std::vector<std::byte> ffs_strings() {
  Bytes language;
  language.u16(0x0409).text("Lightwell light probe");
  Bytes out;
  out.u32(FUNCTIONFS_STRINGS_MAGIC).u32(16 + language.size()).u32(1).u32(1).append(language.all());
  return out.all();
}

}  // namespace lightwell
