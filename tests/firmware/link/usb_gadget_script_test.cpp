// lightwell-usb-gadget on a folder that imitates configfs. The test creates the attributes that a kernel would create,
// and substitutes mount, umount and modprobe by scripts on the PATH.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include <lightwell/text.hpp>
#include <lightwell/usb_ids.hpp>

#include "support/child.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

namespace fs = std::filesystem;

class UsbGadgetScript : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(gadget_ / "functions/ncm.usb0");
    fs::create_directories(gadget_ / "configs/c.1");
    for (const char* name : {"mount", "umount", "modprobe"}) {
      tools_.write(name, "#!/bin/sh\necho " + std::string(name) + " \"$@\" >>" + tools_.path("log") + "\n");
      fs::permissions(tools_.path(name), fs::perms::owner_all);
    }
  }

  struct Run {
    int code = -1;
    std::string err;
  };
  Run run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), LIGHTWELL_USB_GADGET);
    for (const std::string& a : {std::string("--configfs"), root_.path(""), std::string("--mount"), root_.path("ffs")})
      arguments.push_back(a);
    Child child(arguments, {.environment = {"PATH=" + tools_.path("") + ":" + std::getenv("PATH")}});
    return {child.wait().code, child.err()};
  }
  [[nodiscard]] std::string read(const std::string& attribute) const {
    std::ifstream in(gadget_ / attribute);
    std::string line;
    std::getline(in, line);
    return line;
  }
  [[nodiscard]] std::string log() const { return test::read_file(tools_.path("log")); }
  static std::string hex(unsigned v) { return formatted("0x%04x", v); }

  TempDir root_, tools_;
  fs::path gadget_ = fs::path(root_.path("")) / "usb_gadget/lightwell";
};

TEST_F(UsbGadgetScript, BuildsTheGadgetWithTheIdsTheHostExpects) {
  const Run first = run({"up", "--serial", "LW-7"});
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(read("idVendor"), hex(kUsbVendor));
  EXPECT_EQ(read("idProduct"), hex(kUsbProduct));
  EXPECT_EQ(read("strings/0x409/manufacturer"), kUsbManufacturer);
  EXPECT_EQ(read("strings/0x409/serialnumber"), "LW-7");
  EXPECT_TRUE(fs::is_symlink(gadget_ / "configs/c.1/ffs.lightwell"));
  EXPECT_TRUE(fs::is_symlink(gadget_ / "configs/c.1/ncm.usb0"));
  EXPECT_TRUE(fs::is_symlink(gadget_ / "os_desc/c.1"));
  EXPECT_EQ(read("os_desc/use"), "1");
  EXPECT_EQ(read("functions/ncm.usb0/host_addr").size(), 17U) << read("functions/ncm.usb0/host_addr");
  EXPECT_NE(read("functions/ncm.usb0/host_addr"), read("functions/ncm.usb0/dev_addr"));
  EXPECT_NE(log().find("mount -t functionfs -o uid=0,gid=0"), std::string::npos) << log();
  const Run again = run({"up", "--serial", "LW-7"});
  EXPECT_EQ(again.code, 0) << again.err;
}

TEST_F(UsbGadgetScript, TheDefaultSerialNumberIsConstantAndNotTheMachineId) {
  ASSERT_EQ(run({"up", "--no-network"}).code, 0);
  const std::string serial = read("strings/0x409/serialnumber");
  EXPECT_EQ(serial.size(), 12U);
  ASSERT_EQ(run({"up", "--no-network"}).code, 0);
  EXPECT_EQ(read("strings/0x409/serialnumber"), serial);
  std::ifstream in("/etc/machine-id");
  std::string id;
  in >> id;
  EXPECT_EQ(id.find(serial), std::string::npos);
  EXPECT_FALSE(fs::exists(gadget_ / "configs/c.1/ncm.usb0"));
}

TEST_F(UsbGadgetScript, BindsToTheNamedControllerOnceLightwelldServes) {
  ASSERT_EQ(run({"up"}).code, 0);
  const Run early = run({"bind", "--udc", "dummy_udc.0"});
  EXPECT_EQ(early.code, 1);
  EXPECT_NE(early.err.find("start lightwelld"), std::string::npos) << early.err;
  std::ofstream(root_.path("ffs") + "/ep1") << "";
  const Run bound = run({"bind", "--udc", "dummy_udc.0"});
  EXPECT_EQ(bound.code, 0) << bound.err;
  EXPECT_EQ(read("UDC"), "dummy_udc.0");
  EXPECT_EQ(run({"bind", "--udc", "another"}).code, 0);
  EXPECT_EQ(read("UDC"), "dummy_udc.0") << "an existing binding is kept";
  EXPECT_EQ(run({"unbind"}).code, 0);
  EXPECT_EQ(read("UDC"), "");
}

TEST_F(UsbGadgetScript, ErrorsHaveExitStatusAndMessage) {
  EXPECT_EQ(run({}).code, 2);
  EXPECT_EQ(run({"sideways"}).code, 2);
  EXPECT_EQ(run({"up", "--user"}).code, 2) << "--user needs a value";
  const Run nobody = run({"up", "--user", "no-such-user-here"});
  EXPECT_EQ(nobody.code, 1);
  EXPECT_NE(nobody.err.find("no-such-user-here"), std::string::npos) << nobody.err;
  fs::remove_all(gadget_);
  EXPECT_EQ(run({"down"}).code, 0) << "without a gadget down does nothing";
  const Run none = run({"bind"});
  EXPECT_EQ(none.code, 1);
  EXPECT_NE(none.err.find("up"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace lightwell::test
