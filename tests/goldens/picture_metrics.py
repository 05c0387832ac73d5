#!/usr/bin/env python3
"""Independent values for tests/picture_metrics_test.cpp. Needs python3-numpy, python3-scipy and python3-skimage.

FLIP is written from the paper's equations with whole 2D kernels, SSIM is scikit-image's.
"""
import numpy as np
from scipy.ndimage import correlate
from skimage.metrics import structural_similarity

PPD = 67.02


def pictures(width=48, height=40):
    """Two RGB8 pictures, by the formulas that the test has too."""
    y, x = np.mgrid[0:height, 0:width]
    ref = np.stack([(x * 5) % 256, (y * 6) % 256, ((x // 8 + y // 8) % 2) * 200], axis=-1)
    test = np.stack([(x * 5 + (x * y) % 23) % 256, (y * 6) % 256, (((x + 1) // 8 + y // 8) % 2) * 200], axis=-1)
    return ref.astype(np.uint8), test.astype(np.uint8)


def luma(rgb):
    return rgb @ np.array([0.299, 0.587, 0.114])


RGB2XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                    [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                    [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
XYZ2RGB = np.linalg.inv(RGB2XYZ)
WHITE = RGB2XYZ @ np.ones(3)


def linear(srgb8):
    c = srgb8 / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def ycxcz(xyz):
    n = xyz / WHITE
    return np.stack([116 * n[..., 1] - 16, 500 * (n[..., 0] - n[..., 1]), 200 * (n[..., 1] - n[..., 2])], axis=-1)


def from_ycxcz(v):
    y = (v[..., 0] + 16) / 116
    return np.stack([y + v[..., 1] / 500, y, y - v[..., 2] / 200], axis=-1) * WHITE


def lab(xyz):
    n = xyz / WHITE
    d = 6 / 29
    f = np.where(n > d ** 3, np.cbrt(n), n / (3 * d * d) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def hunt(v):
    return np.stack([v[..., 0], 0.01 * v[..., 0] * v[..., 1], 0.01 * v[..., 0] * v[..., 2]], axis=-1)


def hyab(a, b):
    d = a - b
    return np.abs(d[..., 0]) + np.linalg.norm(d[..., 1:], axis=-1)


def csf_kernel(a1, b1, a2, b2):
    r = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi ** 2)) * PPD))
    x, y = np.meshgrid(np.arange(-r, r + 1) / PPD, np.arange(-r, r + 1) / PPD)
    z = x * x + y * y
    g = a1 * np.sqrt(np.pi / b1) * np.exp(-np.pi ** 2 * z / b1) + a2 * np.sqrt(np.pi / b2) * np.exp(-np.pi ** 2 * z / b2)
    return g / g.sum()


def seen(rgb8):
    v = ycxcz(linear(rgb8) @ RGB2XYZ.T)
    kernels = [csf_kernel(1, .0047, 0, 1e-5), csf_kernel(1, .0053, 0, 1e-5), csf_kernel(34.1, .04, 13.5, .025)]
    filtered = np.stack([correlate(v[..., c], kernels[c], mode="nearest") for c in range(3)], axis=-1)
    return hunt(lab(np.clip(from_ycxcz(filtered) @ XYZ2RGB.T, 0, 1) @ RGB2XYZ.T))


def feature_kernels():
    sd = 0.5 * 0.082 * PPD
    r = int(np.ceil(3 * sd))
    x, y = np.meshgrid(np.arange(-r, r + 1), np.arange(-r, r + 1))
    g = np.exp(-(x * x + y * y) / (2 * sd * sd))

    def balanced(k):
        k = k.copy()
        k[k < 0] /= np.abs(k[k < 0].sum())
        k[k > 0] /= k[k > 0].sum()
        return k
    return balanced(-x * g), balanced((x * x / (sd * sd) - 1) * g)


def features(rgb8):
    y = (ycxcz(linear(rgb8) @ RGB2XYZ.T)[..., 0] + 16) / 116
    return [np.hypot(correlate(y, k, mode="nearest"), correlate(y, k.T, mode="nearest")) for k in feature_kernels()]


def flip(ref, test):
    color = hyab(seen(ref), seen(test)) ** 0.7
    green, blue = (hunt(lab(RGB2XYZ @ np.array(c, float))) for c in ((0, 1, 0), (0, 0, 1)))
    cmax = hyab(green, blue) ** 0.7
    knee = 0.4 * cmax
    color = np.where(color < knee, 0.95 / knee * color, 0.95 + (color - knee) / (cmax - knee) * 0.05)
    (er, pr), (et, pt) = features(ref), features(test)
    feature = (np.maximum(np.abs(er - et), np.abs(pr - pt)) / np.sqrt(2)) ** 0.5
    return color ** (1 - feature)


if __name__ == "__main__":
    a, b = pictures()
    f = flip(a, b)
    _, s = structural_similarity(luma(a), luma(b), gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
                                 data_range=255, full=True)
    for name, m in (("flip", f), ("ssim", s)):
        print(name, "mean %.6f" % m.mean(), " ".join("(%d,%d) %.6f" % (x, y, m[y, x]) for x, y in
                                                     ((0, 0), (7, 7), (20, 31), (47, 39), (30, 0))))
    black, white = np.zeros((8, 8, 3), np.uint8), np.full((8, 8, 3), 255, np.uint8)
    print("flip black white %.6f" % flip(black, white).mean())
