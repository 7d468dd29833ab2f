#include "usb_camera/frame_log.hpp"

#include <cerrno>
#include <cinttypes>
#include <cstring>

namespace lightwell::usb_camera {

std::string to_json(const FrameRecord& r) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(),
                "{\"stream\": %" PRIu64 ", \"number\": %" PRIu64 ", \"began_ns\": %" PRId64 ", \"pts\": %" PRIu32
                ", \"exposure_s\": %.9g, \"gain\": %.6g, \"kelvin\": %d, \"bytes\": %" PRIu64 ", \"sent\": %" PRIu64
                ", \"outcome\": \"%s\"}",
                r.stream, r.number, r.began.ns, clock_ticks(r.began), r.settings.exposure_s, r.settings.gain,
                r.settings.kelvin, r.bytes, r.sent, to_string(r.outcome).data());
  return text.data();
}

Status FrameLog::write_to(const std::string& path) {
  file_.reset(std::fopen(path.c_str(), "w"));
  if (file_ != nullptr) return {};
  return {StatusCode::unavailable, "cannot write the log " + path + ": " + std::strerror(errno)};
}

void FrameLog::add(const FrameRecord& record) {
  ++counts_[static_cast<std::size_t>(record.outcome)];
  records_.push_back(record);
  if (records_.size() > keep_) records_.pop_front();
  if (file_ == nullptr) return;
  std::fputs((to_json(record) + "\n").c_str(), file_.get());
  // Flushed per frame, so that other programs can read along and nothing is lost if this one is killed.
  std::fflush(file_.get());
}

}  // namespace lightwell::usb_camera
