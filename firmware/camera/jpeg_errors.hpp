// What libjpeg calls when a JPEG is wrong: for pictures in files and for frames of cameras alike.
#pragma once

#include <array>
#include <csetjmp>
#include <cstdio>
#include <jerror.h>
#include <jpeglib.h>

namespace lightwell {

/// libjpeg calls back with its own structure, which is therefore the first member. It leaves by longjmp to `give_up`:
/// nothing with a destructor may live between that setjmp and a call of libjpeg.
struct JpegErrors {
  jpeg_error_mgr manager{};
  std::jmp_buf give_up{};
  std::array<char, JMSG_LENGTH_MAX> message{};  ///< Why it gave up.

  /// For jpeg_decompress_struct::err, before the structure is created.
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
    std::longjmp(errors.give_up, 1);
  }

  /// libjpeg mends what is broken, with grey, and warns: half a picture.
  static void on_message(j_common_ptr common, int level) {
    // Webcams are known for a byte or two of padding before the end marker; more is a scan that came to its end early.
    constexpr int kPadding = 4;
    if (level >= 0) return;
    const jpeg_error_mgr& e = *common->err;
    if (e.msg_code == JWRN_EXTRANEOUS_DATA && e.msg_parm.i[0] <= kPadding) return;
    fail(common);
  }
};

}  // namespace lightwell
