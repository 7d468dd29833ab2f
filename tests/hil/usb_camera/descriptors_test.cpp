// Parses the descriptors by USB 2.0 and UVC 1.1, independently of the code that writes them.
#include "usb_camera/descriptors.hpp"

#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::usb_camera {
namespace {

using Block = std::vector<unsigned>;

/// Splits descriptors by their length bytes; fails if the lengths do not match.
std::vector<Block> blocks(const Bytes& all) {
  std::vector<Block> out;
  std::size_t at = 0;
  while (at < all.size()) {
    const std::size_t length = all[at];
    if (length < 2 || at + length > all.size()) {
      ADD_FAILURE() << "a descriptor of " << length << " bytes at " << at << " of " << all.size();
      return out;
    }
    out.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(at),
                     all.begin() + static_cast<std::ptrdiff_t>(at + length));
    at += length;
  }
  return out;
}

unsigned word(const Block& b, std::size_t at) { return b.at(at) | b.at(at + 1) << 8; }
unsigned dword(const Block& b, std::size_t at) { return word(b, at) | word(b, at + 2) << 16; }

class Descriptors : public ::testing::TestWithParam<const char*> {
 protected:
  SupportedFormats formats_ = formats_for(GetParam());
  std::vector<Block> blocks_ = blocks(configuration_descriptor(formats_));
};

TEST_P(Descriptors, ConfigurationCountsItsBytesAndInterfaces) {
  ASSERT_FALSE(blocks_.empty());
  const Block& configuration = blocks_.front();
  EXPECT_EQ(configuration.at(1), 2U);
  EXPECT_EQ(word(configuration, 2), configuration_descriptor(formats_).size());
  EXPECT_EQ(configuration.at(5), 1U) << "its value, for SET_CONFIGURATION";
  std::set<unsigned> interfaces;
  int endpoints = 0;
  for (const Block& b : blocks_) {
    if (b[1] == 4) interfaces.insert(b.at(2));
    if (b[1] == 5) ++endpoints;
  }
  EXPECT_EQ(interfaces.size(), configuration.at(4));
  EXPECT_EQ(endpoints, 1);
  const Block& association = blocks_.at(1);
  EXPECT_EQ(association.at(1), 0x0BU);
  EXPECT_EQ(association.at(3), interfaces.size());
  EXPECT_EQ(association.at(4), 0x0EU);
  EXPECT_EQ(association.at(5), 3U) << "a video interface collection";
}

TEST_P(Descriptors, ClassSpecificPartsAddUpToTheirTotals) {
  std::map<unsigned, unsigned> declared, counted;
  unsigned interface = 99;
  for (const Block& b : blocks_) {
    if (b[1] == 4) interface = b.at(2);
    if (b[1] != 0x24) continue;
    counted[interface] += static_cast<unsigned>(b.size());
    if (b.at(2) == 1) declared[interface] = word(b, interface == 0 ? 5 : 4);
  }
  EXPECT_EQ(declared, counted);
  EXPECT_EQ(declared.size(), 2U);
}

TEST_P(Descriptors, UnitsAreLinkedFromTheSensorToTheStream) {
  std::map<unsigned, unsigned> source;
  std::set<unsigned> ids;
  unsigned output = 0, interface = 99;
  for (const Block& b : blocks_) {
    if (b[1] == 4) interface = b.at(2);
    if (b[1] != 0x24 || interface != 0) continue;
    switch (b.at(2)) {
      case 1:
        EXPECT_EQ(word(b, 3), 0x0110U) << "UVC 1.1";
        EXPECT_EQ(dword(b, 7), 1'000'000U);
        EXPECT_EQ(b.at(11), 1U);
        EXPECT_EQ(b.at(12), 1U) << "the streaming interface";
        EXPECT_EQ(b.size(), 13U);
        break;
      case 2:
        EXPECT_EQ(word(b, 4), 0x0201U) << "a camera";
        EXPECT_EQ(b.size(), 15U + b.at(14));
        ids.insert(b.at(3));
        source[b.at(3)] = 0;
        break;
      case 3:
        EXPECT_EQ(word(b, 4), 0x0101U) << "a stream over USB";
        EXPECT_EQ(b.size(), 9U);
        output = b.at(3);
        ids.insert(output);
        source[output] = b.at(7);
        break;
      case 5:
        EXPECT_EQ(b.size(), 10U + b.at(7)) << "of UVC 1.1, with the byte for video standards";
        ids.insert(b.at(3));
        source[b.at(3)] = b.at(4);
        break;
      default:
        ADD_FAILURE() << "subtype " << b.at(2);
    }
  }
  EXPECT_EQ(ids.size(), 3U);
  EXPECT_EQ(source[source[source[output]]], 0U) << "output, processing, camera";
  for (const Block& b : blocks_) {
    if (b[1] == 0x24 && b.at(2) == 1 && b.size() != 13) {
      EXPECT_EQ(b.at(8), output) << "bTerminalLink";
    }
  }
}

TEST_P(Descriptors, EveryFormatHasEverySizeAndRate) {
  std::map<unsigned, std::string> formats;
  std::map<unsigned, std::set<std::pair<unsigned, unsigned>>> sizes;
  std::map<unsigned, unsigned> frames_declared;
  unsigned format = 0, bits = 0, interface = 99, formats_declared = 0;
  for (const Block& b : blocks_) {
    if (b[1] == 4) interface = b.at(2);
    if (b[1] != 0x24 || interface != 1) continue;
    switch (b.at(2)) {
      case 1:
        formats_declared = b.at(3);
        EXPECT_EQ(b.size(), 13U + b.at(3) * b.at(12));
        EXPECT_EQ(b.at(6), 0x81U);
        break;
      case 4: {
        EXPECT_EQ(b.size(), 27U);
        format = b.at(3);
        frames_declared[format] = b.at(4);
        formats[format] = std::string(b.begin() + 5, b.begin() + 9);
        const Block tail(b.begin() + 9, b.begin() + 21);
        EXPECT_EQ(tail, (Block{0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71}));
        bits = b.at(21);
        EXPECT_GE(b.at(22), 1U);
        EXPECT_LE(b.at(22), b.at(4));
        break;
      }
      case 6:
        EXPECT_EQ(b.size(), 11U);
        format = b.at(3);
        frames_declared[format] = b.at(4);
        formats[format] = "MJPG";
        bits = 16;
        break;
      case 5:
      case 7: {
        EXPECT_EQ(b.at(2) == 7, formats[format] == "MJPG");
        EXPECT_EQ(b.size(), 26U + 4 * b.at(25));
        const unsigned width = word(b, 5), height = word(b, 7);
        EXPECT_EQ(b.at(3), sizes[format].size() + 1) << "frames are numbered from 1";
        EXPECT_TRUE(sizes[format].emplace(width, height).second);
        const unsigned bytes = width * height * bits / 8;
        EXPECT_EQ(dword(b, 17), bytes);
        std::set<unsigned> intervals;
        unsigned before = 0;
        for (unsigned i = 0; i < b.at(25); ++i) {
          const unsigned interval = dword(b, 26 + 4 * i);
          EXPECT_GT(interval, before) << "shortest first";
          intervals.insert(before = interval);
        }
        EXPECT_EQ(intervals, (std::set<unsigned>{166666, 333333, 666666}));
        EXPECT_TRUE(intervals.contains(dword(b, 21))) << "the default is one of them";
        EXPECT_EQ(dword(b, 9), bytes * 8 * 15);
        EXPECT_EQ(dword(b, 13), bytes * 8ULL * 60);
        break;
      }
      case 0x0D:
        EXPECT_EQ(b, (Block{6, 0x24, 0x0D, 1, 1, 4})) << "BT.601, as lightwell/pixel.hpp defines YUYV";
        break;
      default:
        ADD_FAILURE() << "subtype " << b.at(2);
    }
  }
  EXPECT_EQ(formats_declared, formats.size());
  std::set<std::string> names;
  for (const auto& [number, name] : formats) {
    names.insert(name);
    EXPECT_EQ(sizes[number].size(), frames_declared[number]);
    for (const FrameSize& size : formats_.sizes)
      EXPECT_TRUE(sizes[number].contains({size.width, size.height})) << name << " " << size.width;
  }
  EXPECT_EQ(names, (std::set<std::string>{"YUY2", "NV12", "MJPG"}));
}

TEST_P(Descriptors, TheEndpointIsHighSpeedBulkIn) {
  const Block& endpoint = blocks_.back();
  EXPECT_EQ(endpoint, (Block{7, 5, 0x81, 2, 0x00, 0x02, 0}));
}

INSTANTIATE_TEST_SUITE_P(Rigs, Descriptors, ::testing::Values("single", "equirect"));

TEST(DeviceDescriptor, HasClassAndVersion) {
  const auto all = blocks(device_descriptor());
  ASSERT_EQ(all.size(), 1U);
  const Block& b = all[0];
  EXPECT_EQ(b.size(), 18U);
  EXPECT_EQ(word(b, 2), 0x0200U);
  EXPECT_EQ((Block{b[4], b[5], b[6]}), (Block{0xEF, 2, 1})) << "interface association";
  EXPECT_EQ(b[17], 1U) << "one configuration";
  EXPECT_EQ(device_qualifier().size(), 10U);
}

TEST(StringDescriptor, HasTheIdentity) {
  const Identity identity{.manufacturer = "a", .product = "bc", .serial = std::string(300, 'x')};
  EXPECT_EQ(string_descriptor(identity, 0), (Bytes{4, 3, 9, 4}));
  EXPECT_EQ(string_descriptor(identity, 2), (Bytes{6, 3, 'b', 0, 'c', 0}));
  ASSERT_TRUE(string_descriptor(identity, 3));
  EXPECT_EQ(string_descriptor(identity, 3)->size(), string_descriptor(identity, 3)->front());
  EXPECT_FALSE(string_descriptor(identity, 4));
}

}  // namespace
}  // namespace lightwell::usb_camera
