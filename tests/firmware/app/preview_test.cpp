// Previews on request: nothing without one, the middle exposure, at most one a second, through the pipeline.
#include "app/preview.hpp"

#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/pipeline.hpp"
#include "firmware/app/preview_frames.hpp"
#include "imaging/jpeg_decoder.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::becomes_true;
using test::ColumnPicture;
using test::EstimatorScript;
using test::FakeEstimator;
using test::FrameColor;
using test::kBlue;
using test::kRed;
using test::kWhite;
using test::Lender;
using test::preview_rig;
using ::testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;

/// Red, green and blue of the middle of a JPEG; 0 where it does not decode to the size of the small picture.
std::array<int, 3> middle_of(const PreviewJpeg& jpeg) {
  std::vector<std::byte> rgb(3UL * kWidth * kHeight);
  if (!jpeg || !JpegDecoder().decode_frame(*jpeg, kWidth, kHeight, rgb)) return {};
  const std::size_t at = 3UL * (kHeight / 2 * kWidth + kWidth / 2);
  return {std::to_integer<int>(rgb[at]), std::to_integer<int>(rgb[at + 1]), std::to_integer<int>(rgb[at + 2])};
}

bool is_red(const std::array<int, 3>& c) { return c[0] > 245 && c[1] < 12 && c[2] < 12; }
bool is_blue(const std::array<int, 3>& c) { return c[2] > 245 && c[0] < 12 && c[1] < 12; }

class PreviewTest : public ::testing::Test {
 protected:
  Frame frame_of(const ColumnPicture& picture, double exposure_s = 0.01) {
    Frame frame = lender_.frame(sequence_++);
    frame.info.exposure_s = exposure_s;
    frame.add_view(picture.view());
    return frame;
  }
  PreviewJpeg request() {
    const Result<PreviewJpeg> jpeg = preview_.request();
    EXPECT_TRUE(jpeg.ok()) << jpeg.status().message();
    return jpeg.ok() ? *jpeg : nullptr;
  }
  void offer(const ColumnPicture& picture) {
    const Frame frame = frame_of(picture);
    preview_.offer({&frame, 1});
  }

  /// The picture of frames that come until one is shown, which a busy machine may delay beyond its age.
  PreviewJpeg picture_of(const std::function<void()>& offer_next) {
    PreviewJpeg jpeg;
    EXPECT_TRUE(becomes_true("there is a picture", [&] {
      offer_next();
      return (jpeg = request()) != nullptr;
    }));
    return jpeg;
  }
  PreviewJpeg picture_of(const ColumnPicture& frames) {
    return picture_of([&] { offer(frames); });
  }

  const ColumnPicture red_{PixelFormat::rgb8, kWidth, kHeight, [](int) { return kRed; }};
  const ColumnPicture blue_{PixelFormat::rgb8, kWidth, kHeight, [](int) { return kBlue; }};
  const ColumnPicture white_{PixelFormat::rgb8, kWidth, kHeight, [](int) { return kWhite; }};
  const RigParameters rig_ = preview_rig(1, kWidth, kHeight);
  Preview preview_{rig_};
  Lender lender_;
  std::uint64_t sequence_ = 1;
};

TEST_F(PreviewTest, AFrameIsCopiedOnlyAfterARequest) {
  offer(red_);
  EXPECT_EQ(request(), nullptr) << "nobody had asked when the frame came";
  EXPECT_EQ(request(), nullptr);
  EXPECT_TRUE(is_blue(middle_of(picture_of(blue_))));
}

TEST_F(PreviewTest, RequestsAtOnceShareAPictureAndThereIsOneASecond) {
  const auto start = std::chrono::steady_clock::now();
  const PreviewJpeg first = picture_of(red_), same = request();
  ASSERT_TRUE(is_red(middle_of(first)));
  if (std::chrono::steady_clock::now() - start < Preview::kMaxAge) {
    EXPECT_EQ(same, first);
  }
  ASSERT_TRUE(becomes_true("the first picture is too old", [&] { return request() == nullptr; }));
  EXPECT_TRUE(is_blue(middle_of(picture_of(blue_))));
  EXPECT_GE(std::chrono::steady_clock::now() - start, Preview::kInterval);
}

TEST_F(PreviewTest, APictureThatNobodyFetchedIsNotShownLater) {
  ASSERT_EQ(request(), nullptr);
  offer(red_);
  std::this_thread::sleep_for(Preview::kMaxAge + std::chrono::milliseconds(20));
  EXPECT_EQ(request(), nullptr);
  EXPECT_TRUE(is_blue(middle_of(picture_of(blue_))));
}

TEST_F(PreviewTest, OfABracketTheMiddleExposureIsShown) {
  const std::array<Frame, 3> bracket{frame_of(white_, 0.1), frame_of(blue_, 0.001), frame_of(red_, 0.01)};
  EXPECT_TRUE(is_red(middle_of(picture_of([&] { preview_.offer(bracket); }))));
}

TEST_F(PreviewTest, TheSmallPictureIsSmallInBytes) {
  // Noise is the worst case of a JPEG.
  const ColumnPicture noise(PixelFormat::rgb8, 1280, 640, [](int x) {
    const auto v = static_cast<unsigned>(x) * 2654435761U;
    return FrameColor{{static_cast<float>(v >> 24) / 255, static_cast<float>(v >> 16 & 255) / 255,
                       static_cast<float>(v >> 8 & 255) / 255},
                      {}};
  });
  Preview preview(preview_rig(1, 1280, 640));
  const Frame frame = frame_of(noise);
  PreviewJpeg jpeg;
  ASSERT_TRUE(becomes_true("there is a picture", [&] {
    preview.offer({&frame, 1});
    return (jpeg = *preview.request()) != nullptr;
  }));
  JpegDecoder::Header header;
  ASSERT_TRUE(JpegDecoder().read_header(*jpeg, header));
  EXPECT_EQ(header.width, 320);
  EXPECT_EQ(header.height, 160);
  EXPECT_LT(jpeg->size(), 64U * 1024);
}

TEST_F(PreviewTest, ThePipelineShowsFramesAlsoWhereTheEstimateFails) {
  EstimatorScript script;
  script.fail_with = invalid_argument("no marker in view");
  Pipeline pipeline(StatusSnapshot{}, std::make_unique<FakeEstimator>(script), EstimatorConfig{});
  pipeline.set_preview(&preview_);
  ASSERT_TRUE(pipeline.start().ok());
  Commands& commands = pipeline;
  ASSERT_TRUE(becomes_true("there is a picture", [&] {
    pipeline.sink().push(frame_of(red_));
    const Result<PreviewJpeg> jpeg = commands.preview();
    return jpeg.ok() && is_red(middle_of(*jpeg));
  }));
  pipeline.stop();
  EXPECT_EQ(lender_.lent(), 0) << "a preview holds no frame of the camera";
}

TEST_F(PreviewTest, WithoutTheOwnersConsentThePipelineRefusesAndNamesTheRemedy) {
  EstimatorScript script;
  Pipeline pipeline(StatusSnapshot{}, std::make_unique<FakeEstimator>(script), EstimatorConfig{});
  const Result<PreviewJpeg> refused = pipeline.preview();
  EXPECT_EQ(refused.status().code(), StatusCode::failed_precondition);
  EXPECT_THAT(refused.status().message(), HasSubstr("images: IMAGE_RECIPIENTS_ALL_CLIENTS"));
}

}  // namespace
}  // namespace lightwell
