using System;
using UnityEngine;
using UnityEngine.Rendering;

/// <summary>A file of `lightwell field --grid`: light probes at the points of a box, x fastest, then y, then z. The
/// fields are the keys of the file, which host_sdk/tools/lightwell_field/README.md describes.</summary>
[Serializable]
public sealed class LightGrid
{
    /// <summary>A light that the harmonics do not hold, with the names of UnityEngine.Light.</summary>
    [Serializable]
    public sealed class ApartLight
    {
        public string type;
        public float[] position, forward, color;
        public float intensity;
    }

    public string format, units;
    public int version;
    public int[] counts, validity, flags;
    public float[] origin, spacing, positions, bound, residual, sphericalHarmonicsL2;
    public ApartLight[] lights;

    /// <summary>Throws FormatException with the reason.</summary>
    public static LightGrid Parse(string json)
    {
        LightGrid grid;
        try
        {
            grid = JsonUtility.FromJson<LightGrid>(json);
        }
        catch (ArgumentException e)
        {
            throw new FormatException("not a file of lightwell field --grid: " + e.Message);
        }
        if (grid == null || grid.format != "lightwell.unity_grid" || grid.version != 1)
            throw new FormatException("not a file of lightwell field --grid, or one of a newer version");
        long points = 1;
        if (!HasLength(grid.counts, 3)) throw new FormatException("the grid's counts are not three numbers");
        foreach (var count in grid.counts)
        {
            if (count < 1 || count > 100000) throw new FormatException("the grid has an axis of " + count + " points");
            points *= count;
        }
        if (!HasLength(grid.origin, 3) || !HasLength(grid.spacing, 3) || !HasLength(grid.positions, 3 * points) ||
            !HasLength(grid.validity, points) || !HasLength(grid.flags, points) || !HasLength(grid.bound, points) ||
            !HasLength(grid.residual, points) || !HasLength(grid.sphericalHarmonicsL2, 27 * points))
            throw new FormatException("the grid's arrays do not have a value for each of its points");
        for (var axis = 0; axis < 3; ++axis)
            if (grid.counts[axis] > 1 && !(grid.spacing[axis] > 0))
                throw new FormatException("the grid's spacing is not positive");
        if (!AreFinite(grid.origin) || !AreFinite(grid.spacing) || !AreFinite(grid.sphericalHarmonicsL2))
            throw new FormatException("the grid holds a number that is not finite");
        foreach (var light in grid.lights ?? (grid.lights = new ApartLight[0]))
            if (light == null || !HasLength(light.position, 3) || !HasLength(light.forward, 3) ||
                !HasLength(light.color, 3))
                throw new FormatException("a light of the grid lacks its position, direction or colour");
        return grid;
    }

    /// <summary>Trilinear between the points around `position` (m, the grid's axes) that have light. False, and no
    /// harmonics, outside the box and where no point has light. An axis of one point has no limits.</summary>
    public bool Sample(Vector3 position, out SphericalHarmonicsL2 harmonics)
    {
        harmonics = new SphericalHarmonicsL2();
        var at = new[] { position.x, position.y, position.z };
        var cell = new int[3];
        var part = new float[3];
        for (var axis = 0; axis < 3; ++axis)
        {
            if (counts[axis] == 1) continue;
            var u = (at[axis] - origin[axis]) / spacing[axis];
            const float slack = 1e-3f; // Single precision.
            if (!(u >= -slack && u <= counts[axis] - 1 + slack)) return false;
            cell[axis] = Math.Min(Math.Max((int)u, 0), counts[axis] - 2);
            part[axis] = Math.Min(Math.Max(u - cell[axis], 0), 1);
        }
        var sum = 0f;
        for (var corner = 0; corner < 8; ++corner)
        {
            int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
            var weight = Weight(x, part[0]) * Weight(y, part[1]) * Weight(z, part[2]);
            if (weight <= 0) continue;
            var point = cell[0] + x + counts[0] * (cell[1] + y + counts[1] * (cell[2] + z));
            if (validity[point] == 0) continue;
            sum += weight;
            for (var rgb = 0; rgb < 3; ++rgb)
                for (var i = 0; i < 9; ++i)
                    harmonics[rgb, i] += weight * sphericalHarmonicsL2[27 * point + 9 * rgb + i];
        }
        if (sum <= 0) return false;
        harmonics *= 1 / sum;
        return true;
    }

    private static float Weight(int upper, float part) => upper != 0 ? part : 1 - part;

    private static bool AreFinite(float[] values) => Array.TrueForAll(values, v => v - v == 0);

    private static bool HasLength(Array array, long length) => array != null && array.LongLength == length;
}
