// Error callbacks of libjpeg, for image files and camera frames and for encoders.
#pragma once

#include <array>
#include <csetjmp>
#include <cstdio>
#include <jerror.h>
#include <jpeglib.h>

namespace lightwell {

/// libjpeg passes a pointer to `manager` to the callbacks, so it must be the first member. Errors longjmp to `jump`: no
/// object with a destructor may live between that setjmp and a call of libjpeg.
struct JpegErrors {
  jpeg_error_mgr manager{};
  std::jmp_buf jump{};
  std::array<char, JMSG_LENGTH_MAX> message{};  ///< The error.

  /// For the member `err` of libjpeg's structures, before the structure is created.
  [[nodiscard]] jpeg_error_mgr* install() {
    jpeg_std_error(&manager);
    manager.error_exit = &JpegErrors::fail;
    manager.emit_message = &JpegErrors::on_message;
    manager.output_message = [](j_common_ptr) {};
    return &manager;
  }

 private:
  [[noreturn]] static void fail(j_common_ptr common) {
    auto& errors = *reinterpret_cast<JpegErrors*>(common->err);
    common->err->format_message(common, errors.message.data());
    std::longjmp(errors.jump, 1);
  }

  /// libjpeg only warns of damaged data and fills the rest of the picture with grey; here a warning is an error.
  static void on_message(j_common_ptr common, int level) {
    // Some webcams write a byte or two of padding before the end marker; more than that is a scan that ended early.
    constexpr int kPadding = 4;
    if (level >= 0) return;
    const jpeg_error_mgr& e = *common->err;
    if (e.msg_code == JWRN_EXTRANEOUS_DATA && e.msg_parm.i[0] <= kPadding) return;
    fail(common);
  }
};

}  // namespace lightwell
