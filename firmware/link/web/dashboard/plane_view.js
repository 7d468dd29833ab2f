export class PlaneView { update() {} }
