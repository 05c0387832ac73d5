#pragma once
#include <filesystem>
#include <istream>
#include <string>

#include "kernels/mesh/mesh.h"

namespace reliefbench {

/// A mesh of a Wavefront OBJ file: v, vt, vn and f, where a face's corners name v/vt or v/vt/vn, by number from 1 or
/// backwards from the last by -1. A face of more than three corners becomes a fan. Groups, materials and smoothing are
/// passed over; anything else is an error, and so are faces without vt, since a relief lies on them by their uv.
/// throws: Error(bad_input) "FILE:LINE: expected ..., found ..."; a file of over kMostTriangles or kMostObjBytes
[[nodiscard]] RawMesh load_obj(const std::filesystem::path& path);
/// name: for messages
[[nodiscard]] RawMesh read_obj(std::istream& in, const std::string& name);

inline constexpr std::uintmax_t kMostObjBytes = 64U << 20U;

}  // namespace reliefbench
