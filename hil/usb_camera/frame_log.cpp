#include "usb_camera/frame_log.hpp"

#include <cerrno>
#include <cstring>

#include <nlohmann/json.hpp>

#include "tools/json_text.hpp"

namespace lightwell::usb_camera {

nlohmann::ordered_json json_of(const FrameRecord& r) {
  return {{"stream", r.stream},
          {"number", r.number},
          {"began_ns", r.began.ns},
          {"pts", clock_ticks(r.began)},
          {"exposure_s", r.settings.exposure_s},
          {"gain", r.settings.gain},
          {"kelvin", r.settings.kelvin},
          {"bytes", r.bytes},
          {"sent", r.sent},
          {"outcome", to_string(r.outcome)}};
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
  std::fputs((json_text(json_of(record)) + "\n").c_str(), file_.get());
  // Flushed per frame, so that other programs can read along and nothing is lost if this one is killed.
  std::fflush(file_.get());
}

}  // namespace lightwell::usb_camera
