// The folder with the files of surveys, which go by age: how many bytes they take, and which are
// removed when that is too much, or when others need the disk more. Nothing of them is kept in
// memory: a file's time says when it was used last, and their bytes are added up again whenever
// some are removed. Thread-safe.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>

#include "core/base/status.h"

namespace atlas {

class SurveyFolder {
 public:
  // Of files; `min_free_bytes` of the disk.
  SurveyFolder(std::filesystem::path directory,
               std::size_t max_bytes,
               std::uintmax_t min_free_bytes);

  std::filesystem::path PathOf(std::uint64_t key) const;
  // Another one each time; of a file that will be PathOf(key) when it is whole.
  std::filesystem::path UnfinishedOf(std::uint64_t key);

  // Looks once at what was there at the start: removes what somebody left unfinished, and that of
  // which `stays` is false. kUnavailable: the folder cannot be listed.
  Status Sort(const std::function<bool(const std::filesystem::path&)>& stays,
              const std::stop_token& stop);

  // A file is the last used one now.
  void Touch(std::uint64_t key) const;
  // A file takes `bytes` from now on, instead of what it took. Removes the oldest if that is too
  // much.
  void Put(std::uint64_t key, std::uintmax_t bytes, std::uintmax_t bytes_before);
  void Remove(std::uint64_t key);
  // Gives the oldest up while the disk has too little room. False: it has not even then.
  bool HasRoom();

  // About: files come and go while they are added up.
  std::size_t bytes() const;

 private:
  void RemoveOldestUntil(const std::function<bool(std::int64_t left_bytes)>& is_enough);

  const std::filesystem::path directory_;
  const std::int64_t max_bytes_;
  const std::uintmax_t min_free_bytes_;
  const std::string ours_;  // in the names of unfinished files
  std::mutex removing_;
  std::atomic<std::int64_t> bytes_ = 0;
  std::atomic<std::uint64_t> writes_ = 0;
};

}  // namespace atlas
