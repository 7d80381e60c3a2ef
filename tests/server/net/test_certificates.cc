#include "tests/server/net/test_certificates.h"

#include <cstdio>
#include <utility>

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

namespace atlas {
namespace {

constexpr long kDay_s = 86'400;

void AddEntry(X509_NAME* name, const char* field, const std::string& text) {
  X509_NAME_add_entry_by_txt(name, field, MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(text.data()),
                             static_cast<int>(text.size()), -1, 0);
}

X509* Make(EVP_PKEY* key,
           const std::string& common_name,
           const std::string& unit,
           const X509* issuer,
           EVP_PKEY* issuer_key,
           const char* basic_constraints) {
  static long serial = 0;
  X509* const made = X509_new();
  X509_set_version(made, X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(made), ++serial);
  X509_gmtime_adj(X509_getm_notBefore(made), -kDay_s);
  X509_gmtime_adj(X509_getm_notAfter(made), kDay_s);
  X509_set_pubkey(made, key);
  X509_NAME* const subject = X509_get_subject_name(made);
  if (!unit.empty()) {
    AddEntry(subject, "OU", unit);
  }
  AddEntry(subject, "CN", common_name);
  X509_set_issuer_name(made, issuer == nullptr ? subject : X509_get_subject_name(issuer));
  X509_EXTENSION* const rights =
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_basic_constraints, basic_constraints);
  X509_add_ext(made, rights, -1);
  X509_EXTENSION_free(rights);
  EXPECT_GT(X509_sign(made, issuer_key, EVP_sha256()), 0);
  return made;
}

void WriteCertificate(const std::filesystem::path& path, const X509* certificate) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(PEM_write_X509(file, certificate), 1);
  std::fclose(file);
}

}  // namespace

TestAuthority::TestAuthority(std::filesystem::path directory,
                             const std::string& name,
                             const TestAuthority* above)
    : directory_(std::move(directory)),
      certificate_(directory_ / (name + ".ca.pem")),
      key_(EVP_EC_gen("P-256")),
      own_(Make(key_,
                name,
                "",
                above == nullptr ? nullptr : above->own_,
                above == nullptr ? key_ : above->key_,
                "critical,CA:TRUE")) {
  WriteCertificate(certificate_, own_);
}

TestAuthority::~TestAuthority() {
  X509_free(own_);
  EVP_PKEY_free(key_);
}

CertificateFiles TestAuthority::Issue(const std::string& common_name,
                                      const std::string& unit) const {
  CertificateFiles files{directory_ / (common_name + unit + ".pem"),
                         directory_ / (common_name + unit + ".key")};
  EVP_PKEY* const key = EVP_EC_gen("P-256");
  X509* const certificate = Make(key, common_name, unit, own_, key_, "critical,CA:FALSE");
  WriteCertificate(files.certificate, certificate);
  std::FILE* const file = std::fopen(files.key.c_str(), "w");
  EXPECT_EQ(PEM_write_PrivateKey(file, key, nullptr, nullptr, 0, nullptr, nullptr), 1);
  std::fclose(file);
  X509_free(certificate);
  EVP_PKEY_free(key);
  return files;
}

void TestAuthority::Revoke(const CertificateFiles& files) const {
  std::FILE* file = std::fopen(files.certificate.c_str(), "r");
  ASSERT_NE(file, nullptr);
  X509* const certificate = PEM_read_X509(file, nullptr, nullptr, nullptr);
  std::fclose(file);
  ASSERT_NE(certificate, nullptr);
  X509_CRL* const list = X509_CRL_new();
  X509_CRL_set_version(list, X509_CRL_VERSION_2);
  X509_CRL_set_issuer_name(list, X509_get_subject_name(own_));
  ASN1_TIME* const time = X509_gmtime_adj(nullptr, -kDay_s);
  X509_REVOKED* const revoked = X509_REVOKED_new();
  X509_REVOKED_set_serialNumber(revoked, X509_get_serialNumber(certificate));
  X509_REVOKED_set_revocationDate(revoked, time);
  X509_CRL_add0_revoked(list, revoked);
  X509_CRL_set1_lastUpdate(list, time);
  X509_gmtime_adj(time, kDay_s);
  X509_CRL_set1_nextUpdate(list, time);
  EXPECT_GT(X509_CRL_sign(list, key_, EVP_sha256()), 0);
  file = std::fopen(certificate_.c_str(), "a");
  EXPECT_EQ(PEM_write_X509_CRL(file, list), 1);
  std::fclose(file);
  ASN1_TIME_free(time);
  X509_CRL_free(list);
  X509_free(certificate);
}

}  // namespace atlas
