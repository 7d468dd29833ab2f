// The descriptors and strings for FunctionFS, checked as the kernel does in drivers/usb/gadget/function/f_fs.c.
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/usb_ids.hpp>

#include "link/usb_gadget/ffs_port.hpp"

namespace lightwell {
namespace {

/// Reads little-endian numbers; reading beyond the end fails the test.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : rest_(bytes) {}
  std::uint32_t number(std::size_t bytes) {
    std::uint32_t v = 0;
    if (rest_.size() < bytes) {
      ADD_FAILURE() << "the bytes end too early";
      return 0;
    }
    for (std::size_t i = 0; i < bytes; ++i) v |= std::to_integer<std::uint32_t>(rest_[i]) << (8 * i);
    rest_ = rest_.subspan(bytes);
    return v;
  }
  std::uint32_t u8() { return number(1); }
  std::uint32_t u16() { return number(2); }
  std::uint32_t u32() { return number(4); }
  std::string text(std::size_t bytes) {
    std::string out;
    for (std::size_t i = 0; i < bytes; ++i) out += static_cast<char>(u8());
    return out;
  }
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

 private:
  std::span<const std::byte> rest_;
};

void expect_interface(Reader& r) {
  EXPECT_EQ(r.u8(), 9U);
  EXPECT_EQ(r.u8(), 4U) << "INTERFACE";
  EXPECT_EQ(r.u8(), 0U) << "number";
  EXPECT_EQ(r.u8(), 0U) << "alternate setting";
  EXPECT_EQ(r.u8(), 2U) << "endpoints";
  EXPECT_EQ(r.u8(), kUsbInterfaceClass);
  EXPECT_EQ(r.u8(), kUsbInterfaceSubclass);
  EXPECT_EQ(r.u8(), kUsbInterfaceProtocol);
  EXPECT_EQ(r.u8(), 1U) << "name, the first string";
}

void expect_endpoint(Reader& r, std::uint32_t address, std::uint32_t packet) {
  EXPECT_EQ(r.u8(), 7U);
  EXPECT_EQ(r.u8(), 5U) << "ENDPOINT";
  EXPECT_EQ(r.u8(), address);
  EXPECT_EQ(r.u8(), 2U) << "bulk";
  EXPECT_EQ(r.u16(), packet) << "USB 2.0, 5.8.3; USB 3.2, 9.6.6";
  EXPECT_EQ(r.u8(), 0U);
}

TEST(FfsDescriptors, HaveABulkPairAtEachSpeedAndOsDescriptors) {
  const std::vector<std::byte> bytes = ffs_descriptors();
  Reader r(bytes);
  EXPECT_EQ(r.u32(), 3U) << "magic of version 2";
  EXPECT_EQ(r.u32(), bytes.size());
  EXPECT_EQ(r.u32(), 15U) << "full, high, super speed, and Microsoft's";
  EXPECT_EQ(r.u32(), 3U);
  EXPECT_EQ(r.u32(), 3U);
  EXPECT_EQ(r.u32(), 5U);
  EXPECT_EQ(r.u32(), 2U);
  for (const std::uint32_t packet : {64U, 512U}) {
    expect_interface(r);
    expect_endpoint(r, 0x81, packet);
    expect_endpoint(r, 0x02, packet);
  }
  expect_interface(r);
  for (const std::uint32_t address : {0x81U, 0x02U}) {
    expect_endpoint(r, address, 1024);
    EXPECT_EQ(r.u8(), 6U);
    EXPECT_EQ(r.u8(), 0x30U) << "SS_ENDPOINT_COMPANION";
    EXPECT_EQ(r.u32(), 0U);
  }

  EXPECT_EQ(r.u8(), 0U) << "interface";
  EXPECT_EQ(r.u32(), 11U + 24U);
  EXPECT_EQ(r.u16(), 1U) << "version";
  EXPECT_EQ(r.u16(), 4U) << "extended compat ID";
  EXPECT_EQ(r.u8(), 1U);
  EXPECT_EQ(r.u8(), 0U);
  EXPECT_EQ(r.u8(), 0U) << "first interface";
  EXPECT_EQ(r.u8(), 1U) << "reserved, 1";
  EXPECT_EQ(r.text(8), std::string("WINUSB\0\0", 8));
  EXPECT_EQ(r.text(14), std::string(14, '\0'));

  const std::size_t before = r.left();
  EXPECT_EQ(r.u8(), 0U);
  EXPECT_EQ(r.u32(), before) << "the last one";
  EXPECT_EQ(r.u16(), 1U);
  EXPECT_EQ(r.u16(), 5U) << "extended properties";
  EXPECT_EQ(r.u16(), 1U);
  const std::size_t property = r.left();
  EXPECT_EQ(r.u32(), property);
  EXPECT_EQ(r.u32(), 1U) << "a string";
  const std::uint32_t name = r.u16();
  EXPECT_EQ(r.text(name), std::string("DeviceInterfaceGUID") + '\0');
  const std::uint32_t value = r.u32();
  EXPECT_EQ(property, 14 + name + value) << "otherwise the kernel refuses all descriptors";
  EXPECT_EQ(r.text(value), std::string(kUsbInterfaceGuid) + '\0');
  EXPECT_EQ(r.left(), 0U);
}

TEST(FfsDescriptors, StringsNameTheInterface) {
  const std::vector<std::byte> bytes = ffs_strings();
  Reader r(bytes);
  EXPECT_EQ(r.u32(), 2U);
  EXPECT_EQ(r.u32(), bytes.size());
  EXPECT_EQ(r.u32(), 1U);
  EXPECT_EQ(r.u32(), 1U);
  EXPECT_EQ(r.u16(), 0x0409U) << "English";
  EXPECT_EQ(r.text(r.left()), std::string("Lightwell light probe") + '\0');
}

}  // namespace
}  // namespace lightwell
