// check_view() and code_at(). Frames themselves are tested by the conformance suite of camera.
#include "imaging/frame.hpp"

#include <cstddef>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightwell {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// A picture of 8x4 pixels with 4 bytes of padding per row.
struct Sample {
  explicit Sample(PixelFormat of) : format(of), stride(packed_stride(of, 8) + 4), data(picture_bytes(of, stride, 4)) {}

  [[nodiscard]] View view() const { return {0, format, 8, 4, stride, data}; }

  PixelFormat format;
  std::size_t stride;
  std::vector<std::byte> data;
};

std::string refusal(const View& view) {
  const Status s = check_view(view);
  EXPECT_TRUE(s.ok() || s.code() == StatusCode::invalid_argument);
  return s.message();
}

TEST(CheckView, AcceptsEveryFormatAndNamesWhatIsTooShort) {
  for (const PixelFormat format : kPixelFormats) {
    const Sample sample(format);
    const std::string picture = "8x4 pixels of " + std::string(to_string(format));
    EXPECT_EQ(refusal(sample.view()), "");
    View narrow = sample.view();
    narrow.stride = packed_stride(format, 8) - 1;
    EXPECT_THAT(refusal(narrow), AllOf(HasSubstr("stride of " + std::to_string(narrow.stride)), HasSubstr(picture)));
    View cut = sample.view();
    cut.data = cut.data.first(cut.data.size() - 1);
    EXPECT_THAT(refusal(cut), AllOf(HasSubstr("too few for " + picture), HasSubstr(std::to_string(cut.data.size())),
                                    HasSubstr(std::to_string(sample.data.size()))));
    cut.data = {};
    EXPECT_THAT(refusal(cut), HasSubstr("too few"));
  }
}

TEST(CheckView, RefusesSizesThatTheFormatCannotHave) {
  const Sample nv12(PixelFormat::nv12), yuyv(PixelFormat::yuyv), rgb8(PixelFormat::rgb8);
  View view = nv12.view();
  view.width = 7;
  EXPECT_THAT(refusal(view), HasSubstr("7x4 pixels of nv12: width and height must be positive multiples of 2 and 2"));
  view = yuyv.view();
  view.height = 3;
  EXPECT_EQ(refusal(view), "") << "its rows do not share chroma";
  view.width = 7;
  EXPECT_THAT(refusal(view), HasSubstr("multiples of 2 and 1"));
  for (const int none : {0, -8}) {
    view = rgb8.view();
    view.height = none;
    EXPECT_THAT(refusal(view), HasSubstr("positive")) << none;
  }
}

TEST(CodeAt, IsTheLumaTheGreenOrTheSampleOfAMosaic) {
  struct Case {
    PixelFormat format;
    std::size_t offset;  ///< In bytes, of the sample of column 3 in its row.
  };
  for (const Case& c : {Case{PixelFormat::rgb8, 10}, Case{PixelFormat::nv12, 3}, Case{PixelFormat::yuyv, 6},
                        Case{PixelFormat::bayer_rggb8, 3}}) {
    Sample sample(c.format);
    sample.data[sample.stride + c.offset] = std::byte{0x21};
    EXPECT_EQ(code_at(sample.view(), 3, 1), 0x21U) << to_string(c.format);
    EXPECT_EQ(code_at(sample.view(), 2, 1), 0U) << to_string(c.format);
  }
  for (const PixelFormat format : {PixelFormat::bayer_rggb10, PixelFormat::bayer_rggb12}) {
    Sample sample(format);
    sample.data[sample.stride + 6] = std::byte{0x21};
    sample.data[sample.stride + 7] = std::byte{0x03};
    EXPECT_EQ(code_at(sample.view(), 3, 1), 0x321U) << to_string(format);
  }
}

}  // namespace
}  // namespace lightwell
