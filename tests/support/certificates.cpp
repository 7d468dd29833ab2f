#include "support/certificates.hpp"

#include "support/child.hpp"

namespace lightwell::test {
namespace {

void openssl(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), LIGHTWELL_OPENSSL);
  Child child(arguments);
  EXPECT_EQ(child.wait(), (ExitStatus{0, 0})) << child.err();
}

std::vector<std::string> request(const KeyPair& out, const std::string& name) {
  return {"req",  "-newkey",       "ec",    "-pkeyopt",   "ec_paramgen_curve:P-256", "-nodes", "-keyout", out.key,
          "-out", out.certificate, "-subj", "/CN=" + name};
}

}  // namespace

Authority::Authority(const std::string& name) : ca_{folder_.path("ca.pem"), folder_.path("ca.key")} {
  std::vector<std::string> arguments = request(ca_, name);
  arguments.insert(arguments.end(), {"-x509", "-days", "2"});
  openssl(arguments);
}

KeyPair Authority::sign(const std::string& name, const std::string& subject_alt_name, int days) const {
  const KeyPair asked{folder_.path(name + ".csr"), folder_.path(name + ".key")};
  openssl(request(asked, name));
  const KeyPair out{folder_.path(name + ".pem"), asked.key};
  openssl({"x509", "-req", "-in", asked.certificate, "-CA", ca_.certificate, "-CAkey", ca_.key, "-CAcreateserial",
           "-days", std::to_string(days), "-extfile",
           folder_.write(name + ".ext", "subjectAltName=" + subject_alt_name + "\n"), "-out", out.certificate});
  return out;
}

}  // namespace lightwell::test
