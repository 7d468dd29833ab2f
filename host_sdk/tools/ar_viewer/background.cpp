#include "ar_viewer/background.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace lightwell::viewer {

struct Background::Impl {
  CameraModel camera;
  std::string name;
  cv::VideoCapture video;
  cv::Mat map_x, map_y;  ///< Empty without distortion.
  Picture picture;
  std::vector<std::uint8_t> grey;
  bool first = true, changed = true;

  void find_undistortion() {
    if (std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double k) { return k == 0; })) return;
    const cv::Mat k = (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
    cv::initUndistortRectifyMap(k, std::vector<double>(camera.distortion.begin(), camera.distortion.end()),
                                cv::noArray(), k, {camera.width, camera.height}, CV_32FC1, map_x, map_y);
  }

  [[nodiscard]] Status check_size(int width, int height) const {
    if (width == camera.width && height == camera.height) return {};
    return invalid_argument(name + ": the background has " + std::to_string(width) + "x" + std::to_string(height) +
                            " pixels, the camera " + std::to_string(camera.width) + "x" +
                            std::to_string(camera.height) +
                            "; set camera.width and camera.height to those of the background");
  }

  void undistort(cv::Mat& rgba) const {
    if (map_x.empty()) return;
    cv::Mat resampled;
    cv::remap(rgba, resampled, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    resampled.copyTo(rgba);
  }

  /// After picture is filled.
  void finish() {
    cv::Mat rgba(picture.height, picture.width, CV_32FC4, picture.rgba.data());
    undistort(rgba);
    grey.resize(picture.rgba.size() / 4);
    for (std::size_t i = 0; i < grey.size(); ++i) {
      const float* p = picture.rgba.data() + 4 * i;
      grey[i] = srgb_code(luminance_of(p[0], p[1], p[2]));
    }
  }

  /// bytes: 3 for each pixel, red at `red`.
  void take(const std::uint8_t* bytes, int red) {
    picture.resize(camera.width, camera.height);
    for (std::size_t i = 0; i < picture.rgba.size() / 4; ++i) {
      const std::uint8_t* p = bytes + 3 * i;
      float* out = picture.rgba.data() + 4 * i;
      out[0] = srgb_linear(p[red]);
      out[1] = srgb_linear(p[1]);
      out[2] = srgb_linear(p[2 - red]);
      out[3] = 0;
    }
    finish();
  }

  Status take_still(float exposure) {
    if (name.ends_with(".exr")) {
      Result<Picture> linear = read_exr(name);
      if (!linear.ok()) return linear.status();
      if (Status status = check_size(linear->width, linear->height); !status.ok()) return status;
      picture = std::move(*linear);
      for (std::size_t i = 0; i < picture.rgba.size(); ++i)
        picture.rgba[i] = i % 4 == 3 ? 0 : picture.rgba[i] * exposure;
      finish();
      return {};
    }
    const Result<BytePicture> bytes = read_bytes(name);
    if (!bytes.ok()) return bytes.status();
    if (Status status = check_size(bytes->width, bytes->height); !status.ok()) return status;
    take(bytes->rgb.data(), 0);
    return {};
  }
};

Background::Background(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Background::Background(Background&&) noexcept = default;
Background& Background::operator=(Background&&) noexcept = default;
Background::~Background() = default;

Result<Background> Background::open(const Scene& scene) {
  auto impl = std::make_unique<Impl>();
  impl->camera = scene.camera;
  impl->name = scene.background;
  impl->find_undistortion();
  const std::string& name = impl->name;
  if (name.empty()) {
    impl->picture.resize(scene.camera.width, scene.camera.height);
    impl->finish();
  } else if (name.ends_with(".exr") || name.ends_with(".png") || name.ends_with(".jpg") || name.ends_with(".jpeg")) {
    if (Status status = impl->take_still(scene.exposure); !status.ok()) return status;
  } else {
    if (!impl->video.open(name))
      return Status(StatusCode::not_found,
                    name + ": no picture (.png, .jpg, .exr), video or camera that OpenCV can open");
    Background background(std::move(impl));
    if (Status status = background.next(); !status.ok()) return status;
    background.impl_->first = true;
    return background;
  }
  return Background(std::move(impl));
}

Status Background::next() {
  Impl& impl = *impl_;
  if (std::exchange(impl.first, false) && !impl.picture.empty()) {
    impl.changed = true;  // open() has read it.
    return {};
  }
  impl.changed = false;
  cv::Mat frame;
  if (!impl.video.isOpened() || !impl.video.read(frame)) {
    if (impl.picture.empty()) return {StatusCode::data_loss, impl.name + ": the video has no picture"};
    return {};
  }
  if (Status status = impl.check_size(frame.cols, frame.rows); !status.ok()) return status;
  if (frame.type() != CV_8UC3 || !frame.isContinuous())
    return {StatusCode::data_loss, impl.name + ": not 8 bit pictures in colour"};
  impl.take(frame.data, 2);
  impl.changed = true;
  return {};
}

const Picture& Background::picture() const { return impl_->picture; }
bool Background::changed() const { return impl_->changed; }
const std::vector<std::uint8_t>& Background::grey() const { return impl_->grey; }

}  // namespace lightwell::viewer
