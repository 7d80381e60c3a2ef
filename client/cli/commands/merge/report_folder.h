// A folder of reports about merges that nobody looked at: what each found, as JSON and as a
// picture, and where one that was not applied would have put keyframes. The newest ones are kept.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include <boost/json/object.hpp>

#include "client/merge/merge_run.h"
#include "core/base/status.h"

namespace atlas {

class ReportFolder {
 public:
  // Makes the folder if it is not there. Requires `kept` above 0. Errors as MakeDirectory,
  // kPermissionDenied for a folder that nothing can be written to.
  static Result<ReportFolder> Open(const std::filesystem::path& folder, std::size_t kept);

  // The files merge-TIME-`fate`.json, .png, and, with corrections, .poses, which `atlas poses
  // apply` reads; then the oldest beyond `kept` go. TIME is UTC, so that names are in the order of
  // time; `fate` is of letters and '-'. Returns the file of JSON. Errors are the disk's.
  Result<std::filesystem::path> Write(const std::string& fate,
                                      const MergeRun& run,
                                      const boost::json::object& json,
                                      bool with_corrections);

 private:
  ReportFolder(std::filesystem::path folder, std::size_t kept)
      : folder_(std::move(folder)), kept_(kept) {}

  Status WriteFiles(const std::filesystem::path& stem,
                    const MergeRun& run,
                    const boost::json::object& json,
                    bool with_corrections) const;
  void RemoveOldest() const;

  std::filesystem::path folder_;
  std::size_t kept_;
};

}  // namespace atlas
