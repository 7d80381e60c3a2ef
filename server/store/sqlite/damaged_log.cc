#include "server/store/sqlite/damaged_log.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::uintmax_t kHeaderBytes = 32;
constexpr std::uintmax_t kFrameHeaderBytes = 24;
constexpr std::streamsize kStepBytes = 64 << 10;

// Nobody looks at what is behind the last commit, so that nobody needs to be waited for.
void CutBehindLastCommit(Connection& writer, const std::filesystem::path& log) {
  const auto page_bytes = static_cast<std::uintmax_t>(writer.Ask("PRAGMA page_size"));
  Query row = writer.Prepare("PRAGMA wal_checkpoint(PASSIVE)");
  row.Step();
  row.Int();  // whether somebody was in its way
  const std::int64_t frames = row.Int();
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(log, error);
  const std::uintmax_t end =
      kHeaderBytes + static_cast<std::uintmax_t>(frames) * (kFrameHeaderBytes + page_bytes);
  if (frames >= 0 && !error && bytes > end) {
    std::filesystem::resize_file(log, end, error);  // else it stays: an alarm too many, one day
  }
}

// What cannot be read is not the same.
bool HaveSameBytes(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::ifstream one(a, std::ios::binary);
  std::ifstream other(b, std::ios::binary);
  std::vector<char> of_one(kStepBytes);
  std::vector<char> of_other(kStepBytes);
  while (one && other) {
    one.read(of_one.data(), kStepBytes);
    other.read(of_other.data(), kStepBytes);
    if (one.gcount() != other.gcount() ||
        !std::equal(of_one.begin(), of_one.begin() + one.gcount(), of_other.begin())) {
      return false;
    }
  }
  return one.eof() && other.eof();
}

// By the first number that is free; or the copy that a start has kept that was refused, for a log
// that stays as it is takes its room once.
Status KeepCopy(const std::filesystem::path& log, DamagedLog& damaged) {
  std::error_code error;
  for (int number = 1; number == 1 || std::filesystem::exists(damaged.kept, error); ++number) {
    damaged.kept = log.string() + StrCat(".damaged-", number);
    if (HaveSameBytes(log, damaged.kept)) {
      return {};
    }
  }
  if (std::filesystem::copy_file(log, damaged.kept, error)) {
    return {};
  }
  if (error != std::errc::file_exists) {  // then a part of it, where the disk is full
    std::error_code ignored;
    std::filesystem::remove(damaged.kept, ignored);
  }
  return {StatusCode::kUnavailable,
          StrCat(log.string(), " is damaged at frame ", damaged.damage.frame,
                 ", and no copy of it can be kept: ", error.message())};
}

}  // namespace

Result<DamagedLog> MendLog(const std::filesystem::path& log) {
  const Result<LogDamage> found = FindLogDamage(log, HasRunSince(log));
  if (!found) {
    return Error(found.error());
  }
  DamagedLog damaged{{}, *found};
  if (damaged.is_lossy() || !found->turned.empty()) {
    if (Status status = KeepCopy(log, damaged); !status.ok()) {
      return Error(std::move(status));
    }
  }
  if (!found->turned.empty()) {
    if (Status status = TurnBack(log, found->turned); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return damaged;
}

std::string LossOf(const DamagedLog& log) {
  return StrCat("the log was damaged at frame ", log.damage.frame, ": ", log.damage.lost_commits,
                " commits are lost");
}

void DropRest(Connection& writer, const std::filesystem::path& log) {
  if (!writer.EmptyLog()) {
    CutBehindLastCommit(writer, log);
  }
}

}  // namespace atlas
