// The part of Godot 4's C# API that examples/godot_light uses, with its signatures, so that it is compiled and run
// without Godot.
using System;

namespace Godot
{
    [AttributeUsage(AttributeTargets.Field | AttributeTargets.Property)]
    public sealed class ExportAttribute : Attribute { }

    public struct Vector3
    {
        public float X, Y, Z;

        public Vector3(float x, float y, float z) { X = x; Y = y; Z = z; }

        public static Vector3 Zero => new Vector3();
        public static Vector3 Up => new Vector3(0, 1, 0);
        public static Vector3 Right => new Vector3(1, 0, 0);
    }

    public struct Color
    {
        public float R, G, B;

        public Color(float r, float g, float b) { R = r; G = g; B = b; }

        public Color LinearToSrgb() => this;
    }

    public static class GD
    {
        public static void PushError(string message) => Console.WriteLine("PushError " + message);
    }

    public class Node
    {
        public bool Inside;

        public bool IsInsideTree() => Inside;
        public virtual void _EnterTree() { }
        public virtual void _ExitTree() { }
        public virtual void _Process(double delta) { }
    }

    public class DirectionalLight3D : Node
    {
        /// <summary>Of this stub: the target of the last LookAtFromPosition.</summary>
        public Vector3 Target;

        public float LightEnergy { get; set; }
        public Color LightColor { get; set; }

        public void LookAtFromPosition(Vector3 position, Vector3 target, Vector3? up = null,
                                       bool useModelFront = false) => Target = target;
    }

    public class Image
    {
        public enum Format { Rgbf = 10 }

        public byte[] Data;
        public int Width, Height;

        public static Image CreateFromData(int width, int height, bool useMipmaps, Format format, byte[] data) =>
            new Image { Width = width, Height = height, Data = (byte[])data.Clone() };
    }

    public class Texture2D { }

    public class ImageTexture : Texture2D
    {
        public Image Shown;

        public void SetImage(Image image) => Shown = image;
    }

    public class Material { }

    public class PanoramaSkyMaterial : Material
    {
        public Texture2D Panorama { get; set; }
    }

    public class Sky
    {
        public Material SkyMaterial { get; set; }
    }

    public class Environment
    {
        public enum BGMode { ClearColor, Color, Sky }

        public enum AmbientSource { Bg, Disabled, Color, Sky }

        public Sky Sky { get; set; }
        public BGMode BackgroundMode { get; set; }
        public AmbientSource AmbientLightSource { get; set; }
    }
}
