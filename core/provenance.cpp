#include "core/provenance.hpp"

#include <openssl/evp.h>

#include "core/check.hpp"
#include "core/io.hpp"
#include "hemowalk_commit.hpp"  // written by the build: HEMOWALK_COMMIT

namespace hemowalk {

std::string version() { return HEMOWALK_VERSION; }

std::string commit() { return HEMOWALK_COMMIT; }

std::string build_description() { return std::string(HEMOWALK_BUILD_TYPE) + ", " HEMOWALK_COMPILER; }

std::string program_description() {
  const std::string from = commit().empty() ? "" : "commit " + commit() + ", ";
  return "hemowalk " + version() + " (" + from + build_description() + ")";
}

std::string sha256(std::string_view bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &length, EVP_sha256(), nullptr) != 1 || length != 32)
    throw Error(Exit::internal,
                "SHA-256 failed (libcrypto has no such digest) check the OpenSSL installation");
  std::string text;
  for (unsigned i = 0; i < length; ++i) {
    text += "0123456789abcdef"[digest[i] >> 4];
    text += "0123456789abcdef"[digest[i] & 15];
  }
  return text;
}

std::string sha256_of_file(const std::string& path) { return sha256(read_file(path, std::size_t{1} << 33)); }

}  // namespace hemowalk
