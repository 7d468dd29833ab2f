#include <gtest/gtest.h>

#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {
namespace {

constexpr std::uint8_t kProbe = 1, kCommit = 2;

Bytes asked(std::uint8_t format, std::uint8_t frame, std::uint32_t interval, std::size_t length = 34) {
  Bytes out = {1, 0, format, frame};
  put(out, interval, 4);
  out.resize(length);
  return out;
}

class NegotiationTest : public ::testing::Test {
 protected:
  Bytes probe(const Bytes& data) {
    EXPECT_TRUE(n_.request(kProbe, ControlRequest::set_cur, data).ok());
    return n_.request(kProbe, ControlRequest::get_cur, {}).data;
  }
  Negotiation n_{formats_for("single")};
};

TEST_F(NegotiationTest, EveryFormatSizeAndRateCanBeCommitted) {
  const SupportedFormats& formats = n_.formats();
  for (std::uint8_t f = 1; f <= formats.encodings.size(); ++f) {
    for (std::uint8_t s = 1; s <= formats.sizes.size(); ++s) {
      for (const int rate : formats.rates) {
        const Bytes got = probe(asked(f, s, interval_of(rate)));
        ASSERT_EQ(got.size(), 34U);
        EXPECT_EQ(got[2], f);
        EXPECT_EQ(got[3], s);
        EXPECT_EQ(get(got, 4, 4), interval_of(rate));
        const FrameSize size = formats.sizes[s - 1U];
        const auto bytes = static_cast<std::uint32_t>(size.width * size.height * (f == 2 ? 3 : 4) / 2);
        EXPECT_EQ(get(got, 18, 4), bytes);
        EXPECT_EQ(get(got, 22, 4), bytes + 12) << "one payload a frame";
        EXPECT_EQ(get(got, 26, 4), 1'000'000U);
        EXPECT_EQ(got[30], 3) << "FID and EOF";
        ASSERT_TRUE(n_.request(kCommit, ControlRequest::set_cur, got).ok());
        const auto agreed = n_.take_commit();
        ASSERT_TRUE(agreed);
        EXPECT_EQ(agreed->format, (StreamFormat{formats.encodings[f - 1U], size, rate}));
        EXPECT_EQ(agreed->frame_bytes, bytes);
        EXPECT_FALSE(n_.take_commit()) << "taken once";
      }
    }
  }
}

TEST_F(NegotiationTest, AProbeForAnUnsupportedFormatReturnsTheNearest) {
  const Bytes got = probe(asked(7, 0, 400000));
  EXPECT_EQ(got[2], 1);
  EXPECT_EQ(got[3], 1);
  EXPECT_EQ(get(got, 4, 4), 333333U);
  EXPECT_EQ(get(probe(asked(1, 1, 1)), 4, 4), 166666U);
  EXPECT_EQ(get(probe(asked(1, 1, 0xFFFFFFFF)), 4, 4), 666666U);
  EXPECT_EQ(get(probe(asked(1, 1, 0)), 4, 4), 333333U) << "interval 0 stands for the default";
}

TEST_F(NegotiationTest, ACommitOfAnUnsupportedFormatIsRejected) {
  EXPECT_EQ(n_.request(kCommit, ControlRequest::set_cur, asked(7, 1, 333333)).error, RequestError::out_of_range);
  EXPECT_EQ(n_.request(kCommit, ControlRequest::set_cur, asked(1, 99, 333333)).error, RequestError::out_of_range);
  EXPECT_EQ(n_.request(kCommit, ControlRequest::set_cur, asked(1, 1, 333334)).error, RequestError::out_of_range);
  EXPECT_FALSE(n_.take_commit());
}

TEST_F(NegotiationTest, LengthsOfVersions10And11) {
  EXPECT_TRUE(n_.request(kProbe, ControlRequest::set_cur, asked(1, 2, 333333, 26)).ok());
  for (const std::size_t bad : {0U, 1U, 25U, 33U, 35U, 48U})
    EXPECT_EQ(n_.request(kProbe, ControlRequest::set_cur, Bytes(bad)).error, RequestError::invalid_request) << bad;
  EXPECT_EQ(n_.request(kProbe, ControlRequest::get_len, {}).data, (Bytes{34, 0}));
  EXPECT_EQ(n_.request(kProbe, ControlRequest::get_info, {}).data, (Bytes{3}));
}

TEST_F(NegotiationTest, RangesAndUnsupportedRequests) {
  EXPECT_EQ(get(n_.request(kProbe, ControlRequest::get_min, {}).data, 4, 4), 166666U);
  EXPECT_EQ(get(n_.request(kProbe, ControlRequest::get_max, {}).data, 4, 4), 666666U);
  EXPECT_EQ(get(n_.request(kProbe, ControlRequest::get_def, {}).data, 4, 4), 333333U);
  EXPECT_EQ(n_.request(kProbe, ControlRequest::get_res, {}).error, RequestError::invalid_request);
  EXPECT_EQ(n_.request(kCommit, ControlRequest::get_min, {}).error, RequestError::invalid_request);
  EXPECT_EQ(n_.request(3, ControlRequest::get_cur, {}).error, RequestError::invalid_control);
}

TEST(NegotiationOfPayloads, PayloadsAreNoLargerThanAFrame) {
  Negotiation n(formats_for("single"), 16384);
  EXPECT_EQ(get(n.request(kProbe, ControlRequest::get_cur, {}).data, 22, 4), 16384U);
  Negotiation large(formats_for("single"), 1U << 30);
  EXPECT_EQ(get(large.request(kProbe, ControlRequest::get_cur, {}).data, 22, 4), 640U * 480 * 2 + 12);
}

}  // namespace
}  // namespace lightwell::usb_camera
