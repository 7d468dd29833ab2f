// Owning pointers for OpenSSL's objects, for .cpp files of this folder.
#pragma once

#include <memory>
#include <string_view>

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <lightwell/deleter.hpp>

namespace lightwell::access {

using Bio = std::unique_ptr<BIO, Deleter<BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Deleter<X509_free>>;

/// Reads `pem`, which must outlive it.
inline Bio reader_of(std::string_view pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

/// Password callback that fails, so that an encrypted file is an error instead of a prompt.
inline int no_password(char*, int, int, void*) { return 0; }

}  // namespace lightwell::access
