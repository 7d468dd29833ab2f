// Images are bit for bit those of the simulated camera with the same options.
#include "usb_camera/scene_source.hpp"

#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>

#include <gtest/gtest.h>

#include "camera/backends/sim/sim_backend.hpp"
#include "imaging/jpeg_decoder.hpp"
#include "support/panorama_file.hpp"
#include "support/temp_dir.hpp"
#include "support/wait.hpp"

namespace lightwell::usb_camera {
namespace {

constexpr FrameSize kSize{160, 120};

/// Collects the frames of the simulated camera by their sequence numbers.
class Frames final : public FrameSink {
 public:
  void push(Frame frame) override {
    const std::lock_guard lock(mutex_);
    const View& view = frame.views()[lens];
    bytes[frame.info.sequence].assign(view.data.begin(), view.data.end());
    exposure_s[frame.info.sequence] = frame.info.exposure_s;
  }
  [[nodiscard]] std::size_t count() {
    const std::lock_guard lock(mutex_);
    return bytes.size();
  }
  std::size_t lens = 0;
  std::map<std::uint64_t, std::vector<std::byte>> bytes;
  std::map<std::uint64_t, double> exposure_s;

 private:
  std::mutex mutex_;
};

class SceneSourceTest : public ::testing::Test {
 protected:
  SceneSourceTest() : scene_(folder_.path("room.exr")) { test::write_exr(scene_, test::room_with_lamp_at_plus_x()); }

  [[nodiscard]] std::string uri(const std::string& parameters) const { return "sim:" + scene_ + "?" + parameters; }

  [[nodiscard]] std::unique_ptr<SceneSource> open(const std::string& parameters, int lens = 0) {
    SceneOptions options;
    options.uri = uri(parameters);
    options.lens = lens;
    Result<std::unique_ptr<SceneSource>> source = SceneSource::open(options, {});
    EXPECT_TRUE(source) << source.status().message();
    return source ? std::move(*source) : nullptr;
  }

  /// Waits for an image and returns it.
  static Picture rendered(SceneSource& source, std::uint64_t number, const SensorSettings& settings) {
    Picture picture;
    EXPECT_TRUE(test::becomes_true("the picture is rendered",
                                   [&] { return (picture = source.picture(number, settings)) != nullptr; }));
    return picture;
  }

  void expect_same(const std::string& parameters, const std::string& sensor, Encoding encoding, int lens = 0) {
    SCOPED_TRACE(parameters + " " + sensor);
    constexpr std::size_t kFrames = 9;
    Result<CameraUri> parsed = parse_camera_uri(uri(parameters + "&sensor=" + sensor));
    ASSERT_TRUE(parsed);
    CameraConfig config{.uri = {}, .width = kSize.width, .height = kSize.height, .frame_rate = 30};
    Result<std::unique_ptr<CameraBackend>> camera = make_sim_backend(*parsed, config);
    ASSERT_TRUE(camera) << camera.status().message();
    ASSERT_TRUE((*camera)->open());
    Frames frames;
    frames.lens = static_cast<std::size_t>(lens);
    ASSERT_TRUE((*camera)->start(frames).ok());
    EXPECT_TRUE(test::becomes_true("nine frames", [&] { return frames.count() >= kFrames; }));
    (*camera)->stop();

    const std::unique_ptr<SceneSource> source = open(parameters, lens);
    ASSERT_TRUE(source->configure({encoding, kSize, 30}).ok());
    for (const auto& [number, bytes] : frames.bytes) {
      const Picture picture = rendered(*source, number, {frames.exposure_s[number], 1, 6500});
      ASSERT_NE(picture, nullptr);
      EXPECT_TRUE(*picture == bytes) << "frame " << number;
    }
  }

  test::TempDir folder_;
  std::string scene_;
};

TEST_F(SceneSourceTest, EqualsTheSimulatedCameraBitForBit) {
  expect_same("rig=single", "yuyv", Encoding::yuyv);
  expect_same("rig=single", "nv12", Encoding::nv12);
  expect_same("rig=pair&seed=7", "yuyv", Encoding::yuyv, 1);
}

TEST_F(SceneSourceTest, EqualsTheSimulatedCameraWithMotionFlickerAndBrackets) {
  expect_same("rig=single&yaw_rate=90deg/s&frames=8", "yuyv", Encoding::yuyv);
  expect_same("rig=single&yaw_rate=90deg/s&frames=8&row_readout=50us", "yuyv", Encoding::yuyv);
  expect_same("rig=single&lamp_switch=0.1s", "nv12", Encoding::nv12);
  expect_same("rig=single&exposure=1ms,8ms", "yuyv", Encoding::yuyv);
  expect_same("rig=single&flicker=100hz&frames=6", "yuyv", Encoding::yuyv);
}

TEST_F(SceneSourceTest, AutomaticExposureIsThatOfTheSimulatedCamera) {
  CameraConfig config{.uri = {}, .width = 64, .height = 48, .frame_rate = 30};
  Result<std::unique_ptr<CameraBackend>> camera =
      make_sim_backend(*parse_camera_uri(uri("rig=single&sensor=yuyv")), config);
  ASSERT_TRUE(camera);
  const Result<CameraInfo> info = (*camera)->open();
  ASSERT_TRUE(info);
  EXPECT_EQ(open("rig=single")->automatic_exposure_s(), info->exposure_s.front());
  EXPECT_EQ(open("rig=single&exposure=3ms")->automatic_exposure_s(), 0.003);
}

TEST_F(SceneSourceTest, SettingsChangeTheImage) {
  const auto source = open("rig=single");
  ASSERT_TRUE(source->configure({Encoding::yuyv, kSize, 30}).ok());
  const Picture base = rendered(*source, 0, {0.001, 1, 6500});
  EXPECT_NE(*rendered(*source, 0, {0.002, 1, 6500}), *base);
  EXPECT_NE(*rendered(*source, 0, {0.001, 2, 6500}), *base);
  EXPECT_NE(*rendered(*source, 0, {0.001, 1, 4000}), *base);
  EXPECT_EQ(rendered(*source, 0, {0.001, 1, 6500}).get(), base.get()) << "from the cache";
  EXPECT_EQ(source->counts().rendered, 4U);
}

TEST_F(SceneSourceTest, WhiteBalanceChangesTheChannels) {
  // The sensor divides its channels by the white balance; the calibration's white_balance inverts that.
  const auto source = open("rig=single");
  ASSERT_TRUE(source->configure({Encoding::yuyv, kSize, 30}).ok());
  const Picture warm = rendered(*source, 0, {0.001, 1, 3000});
  const Picture cold = rendered(*source, 0, {0.001, 1, 8000});
  // With a white balance for incandescent light, the room appears blue: compare Cb at the centre.
  const std::size_t middle = 2 * (60 * 160 + 80) + 1;
  EXPECT_GT(static_cast<int>((*warm)[middle]), static_cast<int>((*cold)[middle]) + 5);
}

TEST_F(SceneSourceTest, MotionJpegShowsTheSameImage) {
  const auto source = open("rig=single");
  const SensorSettings settings{0.001, 1, 6500};
  ASSERT_TRUE(source->configure({Encoding::mjpeg, kSize, 30}).ok());
  const Picture jpeg = rendered(*source, 0, settings);
  std::vector<std::byte> rgb(160 * 120 * 3);
  JpegDecoder decoder;
  ASSERT_TRUE(decoder.decode_frame(*jpeg, 160, 120, rgb)) << "the decoder of the v4l2 backend";
  ASSERT_TRUE(source->configure({Encoding::yuyv, kSize, 30}).ok());
  const Picture yuyv = rendered(*source, 0, settings);
  double luma = 0, shown = 0;
  for (std::size_t i = 0; i < 160 * 120; ++i) {
    const auto c = [&](std::size_t k) { return static_cast<double>(rgb[3 * i + k]); };
    luma += static_cast<double>((*yuyv)[2 * i]);
    shown += 16 + (65.481 * c(0) + 128.553 * c(1) + 24.966 * c(2)) / 255;
  }
  EXPECT_NEAR(shown / (160 * 120), luma / (160 * 120), 0.5) << "mean luma";
  EXPECT_LE(jpeg->size(), largest_frame(Encoding::mjpeg, kSize));
}

TEST_F(SceneSourceTest, ImagesRenderedAheadAreReadyAtOnce) {
  const auto source = open("rig=single&yaw_rate=90deg/s&frames=8");
  const StreamFormat format{Encoding::yuyv, kSize, 30};
  ASSERT_TRUE(source->render_ahead(format, {0.001, 0.008}).ok());
  EXPECT_EQ(source->counts().rendered, 16U);
  ASSERT_TRUE(source->configure(format).ok());
  for (std::uint64_t n = 0; n < 40; ++n) {
    EXPECT_NE(source->picture(n, {0.001, 1, 6500}), nullptr);
    EXPECT_NE(source->picture(n, {0.008, 1, 6500}), nullptr);
  }
  EXPECT_EQ(source->counts().rendered, 16U);
}

TEST_F(SceneSourceTest, LimitsTheCache) {
  SceneOptions options;
  options.uri = uri("rig=single&yaw_rate=90deg/s&frames=16");
  options.memory = 4 * 160 * 120 * 2;
  const auto source = std::move(*SceneSource::open(options, {}));
  ASSERT_TRUE(source->render_ahead({Encoding::yuyv, kSize, 30}, {0.001}).ok());
  EXPECT_LE(source->counts().kept_bytes, options.memory);
  EXPECT_EQ(source->counts().kept, 4U);
}

TEST_F(SceneSourceTest, ChangesTheScene) {
  test::write_exr(folder_.path("dark.exr"), test::room(128, [](Vec3d) { return Radiance{0.1F, 0.1F, 0.1F}; }, {}));
  const auto source = open("rig=single");
  ASSERT_TRUE(source->configure({Encoding::yuyv, kSize, 30}).ok());
  const SensorSettings settings{0.001, 1, 6500};
  const Picture before = rendered(*source, 0, settings);
  const double exposure = source->automatic_exposure_s();
  EXPECT_FALSE(source->set_scene("sim:nowhere").ok());
  EXPECT_FALSE(source->set_scene(uri("rig=single&sensor=yuyv")).ok()) << "the host chooses the format";
  EXPECT_EQ(rendered(*source, 0, settings).get(), before.get()) << "an error must not change the scene";
  ASSERT_TRUE(source->set_scene("sim:" + folder_.path("dark.exr") + "?rig=single").ok());
  EXPECT_NE(*rendered(*source, 0, settings), *before);
  EXPECT_GT(source->automatic_exposure_s(), exposure);
}

TEST_F(SceneSourceTest, RejectsInvalidUris) {
  const auto message = [&](const std::string& text, int lens) {
    SceneOptions options;
    options.uri = text;
    options.lens = lens;
    const auto source = SceneSource::open(options, {});
    return source ? std::string("it opened") : source.status().message();
  };
  EXPECT_NE(message(uri("rig=single"), 1).find("no lens 1"), std::string::npos);
  EXPECT_NE(message("v4l2:/dev/video0", 0).find("sim:SCENE"), std::string::npos);
  EXPECT_NE(message(uri("rigg=single"), 0).find("rig"), std::string::npos);
}

}  // namespace
}  // namespace lightwell::usb_camera
