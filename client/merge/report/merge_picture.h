// A merge as a picture: the ways of its sessions before and after it, seen from above.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "client/render/image.h"

namespace atlas {

struct PictureSession {
  std::string name;
  std::vector<Eigen::Vector2d> before;  // world, metres
  std::vector<Eigen::Vector2d> after;
};

struct MergePicture {
  std::vector<PictureSession> sessions;
  // Where two submaps show the same place, from one middle to the other: as it was before, and
  // after.
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> closures_before;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> closures_after;
};

// Two maps of one scale beside each other, 700 pixels each, closures in grey. Without a point they
// are empty.
Image DrawMerge(const MergePicture& picture);

}  // namespace atlas
