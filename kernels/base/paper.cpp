#include "kernels/base/paper.h"

#include <fmt/format.h>

#include <array>

namespace reliefbench {
namespace {

constexpr std::array kPapers{
    Paper{.id = "AL09",
          .authors = "Aila, Laine",
          .title = "Understanding the Efficiency of Ray Traversal on GPUs",
          .where = "HPG 2009"},
    Paper{.id = "BES12",
          .authors = "Baboud, Eisemann, Seidel",
          .title = "Precomputed Safety Shapes for Efficient and Accurate Height-Field Rendering",
          .where = "2012"},
    Paper{.id = "BVBV24", .authors = "Bán, Valasek, Bálint, Vad", .title = "Robust Cone Step Mapping", .where = "2024"},
    Paper{.id = "CHRS17",
          .authors = "Chahdi, Halli, Ragragui, Satori",
          .title = "Per-Pixel Displacement Mapping Using Hybrid Cone Approach",
          .where = "2017"},
    Paper{.id = "DON05",
          .authors = "Donnelly",
          .title = "Per-Pixel Displacement Mapping with Distance Functions",
          .where = "GPU Gems 2, chapter 8, 2005"},
    Paper{.id = "DRO18",
          .authors = "Drobot",
          .title = "Quadtree Displacement Mapping with Height Blending",
          .where = "GPU Pro 360, 2018"},
    Paper{.id = "DUM06",
          .authors = "Dummer",
          .title = "Cone Step Mapping: An Iterative Ray-Heightfield Intersection Algorithm",
          .where = "2006"},
    Paper{.id = "HSST08",
          .authors = "Halli, Saaidi, Satori, Tairi",
          .title = "Per-Pixel Displacement Mapping Using Cone Tracing",
          .where = "2008"},
    Paper{.id = "KAN01",
          .authors = "Kaneko et al.",
          .title = "Detailed Shape Representation with Parallax Mapping",
          .where = "2001"},
    Paper{.id = "PO07",
          .authors = "Policarpo, Oliveira",
          .title = "Relaxed Cone Stepping for Relief Mapping",
          .where = "GPU Gems 3, chapter 18, 2007"},
    Paper{.id = "RIS05", .authors = "Risser", .title = "Interval Mapping", .where = "2005"},
    Paper{.id = "RTM",
          .authors = "",
          .title = "Advanced Mapping Techniques and Ray Tracing on the GPU",
          .where = "chapter 5: relief texture mapping"},
    Paper{.id = "TIS08",
          .authors = "Tevs, Ihrke, Seidel",
          .title = "Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field Rendering",
          .where = "2008"},
    Paper{.id = "VB22",
          .authors = "Valasek, Bán",
          .title = "Quick Cone Map Generation on the GPU",
          .where = "Eurographics 2022 short papers"},
};

}  // namespace

std::span<const Paper> papers() { return kPapers; }

std::vector<Paper> papers_cited_by(std::string_view text) {
  std::vector<Paper> cited;
  for (const Paper& paper : papers())
    if (text.find(fmt::format("[{}]", paper.id)) != std::string_view::npos) cited.push_back(paper);
  return cited;
}

}  // namespace reliefbench
