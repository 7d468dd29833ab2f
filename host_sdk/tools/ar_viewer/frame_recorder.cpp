#include "ar_viewer/frame_recorder.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <opencv2/videoio.hpp>

namespace lightwell::viewer {

struct FrameRecorder::Video {
  std::string name;
  cv::VideoWriter writer;
  cv::Mat encoded;
};

FrameRecorder::FrameRecorder(std::string folder) : folder_(std::move(folder)) {}
FrameRecorder::~FrameRecorder() = default;

std::string FrameRecorder::free_name(const std::string& name, const std::string& ending) const {
  for (int i = 0;; ++i) {
    std::array<char, 16> number{};
    (void)std::snprintf(number.data(), number.size(), "_%04d", i);
    const auto path = std::filesystem::path(folder_) / (name + number.data() + ending);
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return path.string();
  }
}

Result<std::string> FrameRecorder::write_screenshot(const Picture& picture) const {
  const std::string name = free_name("screenshot", ".png");
  if (Status status = write_png(name, picture); !status.ok()) return status;
  return name;
}

bool FrameRecorder::records_video() const { return video_ != nullptr; }

Result<std::string> FrameRecorder::toggle_video(int width, int height) {
  if (video_) {
    const std::string name = video_->name;
    video_.reset();
    return name;
  }
  auto video = std::make_unique<Video>();
  video->name = free_name("video", ".avi");
  video->encoded.create(height, width, CV_8UC3);
  if (!video->writer.open(video->name, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), kFramesPerSecond, {width, height}))
    return Status(StatusCode::failed_precondition, video->name + ": the video cannot be written");
  video_ = std::move(video);
  return video_->name;
}

void FrameRecorder::add(const Picture& picture) {
  if (!video_ || picture.width != video_->encoded.cols || picture.height != video_->encoded.rows) return;
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column) {
      const float* p = picture.at(column, row);
      video_->encoded.at<cv::Vec3b>(row, column) = {srgb_code(p[2]), srgb_code(p[1]), srgb_code(p[0])};
    }
  video_->writer.write(video_->encoded);
}

}  // namespace lightwell::viewer
