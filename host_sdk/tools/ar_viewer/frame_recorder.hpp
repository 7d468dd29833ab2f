// Screenshots and videos of the viewer's frames.
#pragma once

#include <memory>
#include <string>

#include <lightwell/result.hpp>

#include "ar_viewer/picture.hpp"

namespace lightwell::viewer {

/// Writes numbered files that do not exist yet: screenshot_0000.png, video_0000.avi (motion JPEG).
class FrameRecorder {
 public:
  explicit FrameRecorder(std::string folder);
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;
  ~FrameRecorder();

  /// The name of the file.
  [[nodiscard]] Result<std::string> write_screenshot(const Picture& picture) const;
  /// Begins a video, or ends the one that runs. The name of the file.
  [[nodiscard]] Result<std::string> toggle_video(int width, int height);
  [[nodiscard]] bool records_video() const;
  /// A frame of the video.
  void add(const Picture& picture);

  static constexpr double kFramesPerSecond = 30;

 private:
  struct Video;
  [[nodiscard]] std::string free_name(const std::string& name, const std::string& ending) const;

  std::string folder_;
  std::unique_ptr<Video> video_;
};

}  // namespace lightwell::viewer
