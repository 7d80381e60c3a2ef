// Certificates for a test: an authority of its own, and what it vouches for, as files.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

struct evp_pkey_st;
struct x509_st;

namespace atlas {

struct CertificateFiles {
  std::filesystem::path certificate;
  std::filesystem::path key;
};

class TestAuthority {
 public:
  // Its files are put in `directory`, which is there. Without one above it vouches for itself.
  TestAuthority(std::filesystem::path directory,
                const std::string& name,
                const TestAuthority* above = nullptr);
  TestAuthority(const TestAuthority&) = delete;
  TestAuthority& operator=(const TestAuthority&) = delete;
  ~TestAuthority();

  // Of the authority itself.
  const std::filesystem::path& certificate() const { return certificate_; }
  // For a name, and an organizational unit if it is not empty.
  CertificateFiles Issue(const std::string& common_name, const std::string& unit = "") const;
  // Adds a list of revocations with this certificate to the authority's own file.
  void Revoke(const CertificateFiles& files) const;

 private:
  std::filesystem::path directory_;
  std::filesystem::path certificate_;
  evp_pkey_st* key_;
  x509_st* own_;
};

}  // namespace atlas
