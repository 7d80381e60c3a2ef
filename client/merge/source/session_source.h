// Where a merge reads sessions from: a daemon or an atlas file.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/atlas_file/atlas_file.h"
#include "client/connection/atlas_client.h"
#include "client/connection/requests.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

class SessionSource {
 public:
  virtual ~SessionSource() = default;

  virtual std::string name() const = 0;  // for people
  virtual const MapProfile& profile() const = 0;
  virtual Result<std::vector<SessionSummary>> ListSessions() = 0;
  // In any order, damaged ones too.
  virtual Result<SessionReading> ReadKeyframes(
      const SessionKey& session, const std::function<Status(SessionKeyframe)>& on_keyframe) = 0;
};

// The client outlives it.
class DaemonSessions : public SessionSource {
 public:
  explicit DaemonSessions(AtlasClient& client, std::string name = "the daemon")
      : client_(client), name_(std::move(name)) {}

  std::string name() const override { return name_; }
  const MapProfile& profile() const override { return client_.profile(); }
  Result<std::vector<SessionSummary>> ListSessions() override { return client_.ListSessions(); }
  Result<SessionReading> ReadKeyframes(
      const SessionKey& session,
      const std::function<Status(SessionKeyframe)>& on_keyframe) override {
    return client_.ReadKeyframes(session, std::nullopt, on_keyframe);
  }

 private:
  AtlasClient& client_;
  std::string name_;
};

// With a connection of its own.
class ConnectedSessions : public DaemonSessions {
 public:
  ConnectedSessions(std::unique_ptr<AtlasClient> client, std::string name)
      : DaemonSessions(*client, std::move(name)), client_(std::move(client)) {}

 private:
  std::unique_ptr<AtlasClient> client_;
};

class FileSessions : public SessionSource {
 public:
  FileSessions(AtlasFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}

  std::string name() const override { return name_; }
  const MapProfile& profile() const override { return file_.profile(); }
  Result<std::vector<SessionSummary>> ListSessions() override { return file_.ListSessions(); }
  Result<SessionReading> ReadKeyframes(
      const SessionKey& session,
      const std::function<Status(SessionKeyframe)>& on_keyframe) override {
    return file_.ReadKeyframes(session, std::nullopt, on_keyframe);
  }

 private:
  AtlasFile file_;
  std::string name_;
};

}  // namespace atlas
