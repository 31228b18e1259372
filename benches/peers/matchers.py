"""Template matchers to compare with model S, one per process: matchers.py NAME --photo FILE --outline JSON --threads N.

in:   {"image": PATH}                                          a picture
out:  {"seconds": s, "found": [[x, y, angle, score], ...]}     centre of the outline's box, pixels; degrees, clockwise
                                                               as seen, from the photo; best first
The first message is {"ready": {"version": ..., "seconds": s}}, with the seconds for learning the photo. All matchers search for the part
at all angles and at the photo's size, because none of them supports other sizes.
"""

import argparse
import json
import math
import os
import sys
import time
from importlib.metadata import version

import cv2
import numpy as np

MOST_FOUND = 40


class Part:
    """The photo, which `turned` rotates about the centre of the outline's box."""

    def __init__(self, photo, outline):
        self.photo, self.outline = photo, np.array(outline, np.float64)
        low, high = self.outline.min(0), self.outline.max(0)
        self.middle, self.extent = (low + high) / 2, float((high - low).max())

    def turned(self, degrees):
        """Picture and mask of the part, cropped to it, and the position of the centre in them."""
        # OpenCV's positive angles are counter-clockwise as seen.
        turn = cv2.getRotationMatrix2D(tuple(self.middle), -degrees, 1.0)
        outline = self.outline @ turn[:, :2].T + turn[:, 2]
        low = np.floor(outline.min(0)) - 1
        width, height = (np.ceil(outline.max(0)) + 1 - low).astype(int)
        turn[:, 2] -= low
        picture = cv2.warpAffine(self.photo, turn, (width, height), borderMode=cv2.BORDER_REPLICATE)
        mask = np.zeros((height, width), np.uint8)
        cv2.fillPoly(mask, [np.round((outline - low) * 16).astype(np.int32)], 255, shift=4)
        return picture, mask, self.middle - low

    def shrunk(self, factor):
        size = [max(1, round(side / factor)) for side in self.photo.shape[1::-1]]
        scale = np.array(size) / self.photo.shape[1::-1]
        return Part(cv2.resize(self.photo, size, interpolation=cv2.INTER_AREA), self.outline * scale)


def apart(found, distance):
    """The results, best first, without those nearer than `distance` to a better one."""
    kept = []
    for one in sorted(found, key=lambda one: -one[3]):
        if all(math.hypot(one[0] - other[0], one[1] - other[1]) >= distance for other in kept):
            kept.append(one)
        if len(kept) == MOST_FOUND:
            break
    return kept


class MatchTemplate:
    """Normalised correlation under the mask, first with a part of 50 to 100 pixels, then at full size around the best positions."""

    STEP, COARSE_PX, REFINED = 5, 50, 12

    def __init__(self, photo, outline):
        self.part = Part(cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY), outline)
        self.factor = 2 ** max(0, math.floor(math.log2(self.part.extent / self.COARSE_PX)))
        coarse = self.part.shrunk(self.factor)
        self.coarse = [(degrees, *coarse.turned(degrees)) for degrees in range(0, 360, self.STEP)]

    @staticmethod
    def scores(picture, template, mask):
        if picture.shape[0] < template.shape[0] or picture.shape[1] < template.shape[1]:
            return None
        scores = cv2.matchTemplate(picture, template, cv2.TM_CCOEFF_NORMED, mask=mask)
        # The correlation with uniform grey is undefined.
        return np.where(np.isfinite(scores) & (scores <= 1.01), scores, -1)

    def find(self, picture):
        gray = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        small = cv2.resize(gray, None, fx=1 / self.factor, fy=1 / self.factor, interpolation=cv2.INTER_AREA)
        starts = []
        for degrees, template, mask, middle in self.coarse:
            scores = self.scores(small, template, mask)
            if scores is None:
                continue
            peaks = (scores == cv2.dilate(scores, np.ones((7, 7)))) & (scores > 0.3)
            for y, x in np.argwhere(peaks):
                at = (np.array([x, y]) + middle) * self.factor
                starts.append((*at, degrees, float(scores[y, x])))
        starts = apart(starts, 0.25 * self.part.extent)[: self.REFINED]
        return apart([self.refined(gray, start) for start in starts], 0.25 * self.part.extent)

    def refined(self, gray, start):
        best = start[:3] + (-1.0,)
        reach = 2 * self.factor + 2
        for degrees in range(start[2] - self.STEP, start[2] + self.STEP + 1):
            template, mask, middle = self.part.turned(degrees)
            left, top = (int(round(start[axis] - middle[axis])) - reach for axis in (0, 1))
            left, top = max(left, 0), max(top, 0)
            window = gray[top : top + template.shape[0] + 2 * reach, left : left + template.shape[1] + 2 * reach]
            scores = self.scores(window, template, mask)
            if scores is None:
                continue
            _, score, _, (x, y) = cv2.minMaxLoc(scores)
            if score > best[3]:
                best = (left + x + middle[0], top + y + middle[1], degrees, score)
        return best


class Linemod:
    """LINE-2D of opencv-contrib: quantised gradient directions, one template per angle."""

    STEP, LEAST_SIMILARITY = 5, 60

    def __init__(self, photo, outline):
        self.part = Part(photo, outline)
        self.detector = cv2.linemod.getDefaultLINE()
        self.templates = []
        for degrees in range(0, 360, self.STEP):
            picture, mask, middle = self.part.turned(degrees)
            # Gradients at the mask's edge need the pixels around it.
            border = 16
            picture = cv2.copyMakeBorder(picture, *[border] * 4, cv2.BORDER_REPLICATE)
            mask = cv2.copyMakeBorder(mask, *[border] * 4, cv2.BORDER_CONSTANT, value=0)
            number, (left, top, _, _) = self.detector.addTemplate([picture], "part", mask)
            if number >= 0:
                self.templates.append((degrees, middle + border - (left, top)))

    def find(self, picture):
        # The strides of both levels must divide the sides of the response maps. If a template extends beyond the picture, the
        # search reads beyond its memory; a border of the part's length prevents this.
        border = math.ceil(self.part.extent)
        height, width = (side + 2 * border for side in picture.shape[:2])
        padded = cv2.copyMakeBorder(
            picture, border, border + -height % 80, border, border + -width % 80, cv2.BORDER_REPLICATE
        )
        matches, _ = self.detector.match([padded], self.LEAST_SIMILARITY)
        found = []
        for match in matches[:4000]:
            degrees, middle = self.templates[match.template_id]
            x, y = match.x + middle[0] - border, match.y + middle[1] - border
            if 0 <= x < picture.shape[1] and 0 <= y < picture.shape[0]:
                found.append((x, y, degrees, match.similarity / 100))
        return apart(found, 0.25 * self.part.extent)


class Corrmatch:
    """corrmatch with the outline's box as rectangle, and as many levels as leave the template at least 12 pixels."""

    LEAST_PX = 12

    def __init__(self, photo, outline):
        import corrmatch
        from corrmatch.config import CompileConfig, MatchConfig

        self.part = Part(cv2.cvtColor(photo, cv2.COLOR_BGR2GRAY), outline)
        low, high = (np.round(bound(self.part.outline, axis=0)).astype(int) for bound in (np.min, np.max))
        template = np.ascontiguousarray(self.part.photo[low[1] : high[1], low[0] : high[0]])
        levels = max(1, 1 + math.floor(math.log2(min(template.shape) / self.LEAST_PX)))
        compiled = corrmatch.Template(template).compile(CompileConfig(max_levels=levels))
        config = MatchConfig(rotation="enabled", parallel=True, max_image_levels=levels, beam_width=20)
        self.matcher = compiled.matcher(config)
        # A match gives the upper left corner of the rectangle before its rotation about its centre.
        self.middle = np.array(template.shape[::-1]) / 2

    def find(self, picture):
        gray = np.ascontiguousarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
        try:
            matches = self.matcher.match_topk(gray, MOST_FOUND)
        except RuntimeError as error:
            # This error means that nothing was found.
            print(error, file=sys.stderr)
            return []
        found = [(one.x + self.middle[0], one.y + self.middle[1], one.angle_deg, one.score) for one in matches]
        return apart(found, 0.25 * self.part.extent)


KINDS = {
    "matchtemplate": (MatchTemplate, "opencv", lambda: cv2.__version__),
    "linemod": (Linemod, "opencv-contrib", lambda: cv2.__version__),
    "corrmatch": (Corrmatch, "corrmatch", lambda: version("corrmatch")),
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--photo", required=True)
    parser.add_argument("--outline", required=True, type=json.loads)
    parser.add_argument("--threads", required=True, type=int)
    args = parser.parse_args()
    os.environ["RAYON_NUM_THREADS"] = str(args.threads)
    cv2.setNumThreads(args.threads)
    kind, name, number = KINDS[args.kind]
    # Output of libraries must not get into the protocol.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    start = time.perf_counter()
    matcher = kind(cv2.imread(args.photo), args.outline)
    ready = {"version": f"{name} {number()}", "seconds": time.perf_counter() - start}
    answers.write(json.dumps({"ready": ready}) + "\n")
    path, picture = None, None
    for line in sys.stdin:
        asked = json.loads(line)["image"]
        if asked != path:
            path, picture = asked, cv2.imread(asked)
        start = time.perf_counter()
        found = matcher.find(picture)
        seconds = time.perf_counter() - start
        answers.write(json.dumps({"seconds": seconds, "found": [list(map(float, one)) for one in found]}) + "\n")


main()
